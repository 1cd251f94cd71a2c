#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "base/arena.h"
#include "base/image.h"
#include "pipeline/limits.h"

namespace grapnel {

/// A copy of a depth image inside a border of zeros, as the row kernels want it.
class PaddedDepth {
 public:
  static constexpr int kBorder = 2;  ///< half of the largest window

  void reserve(Arena& arena, const Limits& limits);
  void copy(const ImageView<const std::uint16_t>& depth) noexcept;

  /// Row v of the image (-kBorder … height + kBorder - 1), starting `border` pixels left of its
  /// first pixel.
  [[nodiscard]] const std::uint16_t* row(int v, int border) const noexcept {
    return memory_.data() + static_cast<std::size_t>(v + kBorder) * stride_ +
           static_cast<std::size_t>(kBorder - border);
  }

 private:
  std::span<std::uint16_t> memory_;
  std::size_t stride_ = 0;
};

}  // namespace grapnel
