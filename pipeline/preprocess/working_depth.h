#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>

#include "base/arena.h"
#include "base/geometry.h"
#include "base/image.h"
#include "pipeline/limits.h"

namespace grapnel {

/// A region of interest has no more rows, whatever its pixels.
inline constexpr int kMostRows = 4096;

/// Labels of WorkingDepth::label: components count from 1.
inline constexpr std::uint8_t kNoLabel = 0;
inline constexpr std::uint8_t kForeground = 255;

/// Eight labels at once, the first in the lowest byte of a little-endian machine; 0 = none is set.
[[nodiscard]] inline std::uint64_t eight_labels(const std::uint8_t* labels) noexcept {
  static_assert(kNoLabel == 0);
  std::uint64_t eight = 0;
  std::memcpy(&eight, labels, sizeof eight);
  return eight;
}

/// The region of interest of one frame, copied: what the preprocessing steps change. The frame
/// itself stays as it came, for the judge.
struct WorkingDepth {
  ImageView<std::uint16_t> depth;  ///< counts; 0 = no reading
  /// kNoLabel: no reading or background. kForeground: a reading above the background that belongs
  /// to no kept component. 1…32: the component's number in the Components list plus one.
  ImageView<std::uint8_t> label;
  int left = 0;           ///< column of the frame that column 0 is
  int top = 0;            ///< row of the frame that row 0 is
  Intrinsics intrinsics;  ///< of the region: principal point already shifted
  double metres_per_unit = 0.001;

  std::span<std::uint16_t> depth_memory;
  std::span<std::uint8_t> label_memory;

  void reserve(Arena& arena, const Limits& limits);
  [[nodiscard]] double depth_m(int u, int v) const noexcept {
    return metres_per_unit * static_cast<double>(depth.at(u, v));
  }
};

}  // namespace grapnel
