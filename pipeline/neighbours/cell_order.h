#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "base/arena.h"
#include "pipeline/surface.h"

namespace grapnel {

/// The points of a cloud sorted by the cubic cell they lie in, ties by index: cells counted from
/// the floor of the cloud's minimum, linear index with x fastest (as PCL's VoxelGrid).
class CellOrder {
 public:
  void reserve(Arena& arena, std::size_t max_points);

  /// False when the cloud spans more cells than a key holds (2^36). Coordinates must be finite.
  /// O(n).
  [[nodiscard]] bool sort(const Surface& surface, double edge_m) noexcept;

  [[nodiscard]] std::size_t size() const noexcept { return size_; }
  [[nodiscard]] std::size_t point(std::size_t i) const noexcept {
    return static_cast<std::size_t>(entry_[i] & kIndexMask);
  }
  [[nodiscard]] bool same_cell(std::size_t i, std::size_t j) const noexcept {
    return entry_[i] >> kIndexBits == entry_[j] >> kIndexBits;
  }
  /// Where the run of points of the i-th point's cell ends.
  [[nodiscard]] std::size_t end_of_cell(std::size_t i) const noexcept {
    std::size_t end = i + 1;
    while (end < size_ && same_cell(end, i)) ++end;
    return end;
  }
  [[nodiscard]] std::size_t occupied_cells() const noexcept;

 private:
  static constexpr unsigned kIndexBits = 28;
  static constexpr std::uint64_t kIndexMask = (std::uint64_t{1} << kIndexBits) - 1;

  void radix_sort(std::uint64_t largest_key) noexcept;

  std::span<std::uint64_t> entry_, other_;  // cell << kIndexBits | point
  std::size_t size_ = 0;
};

}  // namespace grapnel
