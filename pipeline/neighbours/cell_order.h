#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "base/arena.h"
#include "pipeline/surface.h"

namespace grapnel {

struct Extent {
  float low = 0.0F;
  float high = 0.0F;
};
/// Of at least one value. O(n).
[[nodiscard]] Extent extent_of(std::span<const float> values) noexcept;

/// The occupied cubic cells of a cloud in their order: cells counted from the floor of the cloud's
/// minimum, linear index with x fastest (as PCL's VoxelGrid).
///
/// Without a sort: a bit for each cell, and a cell's number is how many bits are set before its
/// own. Where the cells are too many for that, a bit stands for 64 of them, or 64², and only those
/// that hold a point are looked into.
class CellOrder {
 public:
  /// 24 bytes a point.
  void reserve(Arena& arena, std::size_t max_points);

  /// Numbers the cells that hold a point. False when the cloud spans more cells than a key holds
  /// (2^36). Coordinates must be finite. O(n).
  [[nodiscard]] bool number(const Surface& surface, double edge_m) noexcept;
  /// The same, and the points of each cell, by index.
  [[nodiscard]] bool sort(const Surface& surface, double edge_m) noexcept;

  /// How many cells hold a point.
  [[nodiscard]] std::size_t cells() const noexcept { return cells_; }
  /// The cell of each point.
  [[nodiscard]] std::span<const std::uint32_t> cell_of() const noexcept {
    return cell_of_.first(size_);
  }
  /// The points of a cell, after sort().
  [[nodiscard]] std::span<const std::uint64_t> points_of(std::size_t cell) const noexcept {
    const std::size_t begin = cell > 0 ? before_[cell - 1] : 0;
    return key_.subspan(begin, before_[cell] - begin);
  }

 private:
  std::size_t look_into(std::size_t words, unsigned shift) noexcept;

  std::span<std::uint64_t> key_;      // linear cell of each point; once sorted: the points
  std::span<std::uint64_t> word_;     // 64 cells of a level each
  std::span<std::uint32_t> before_;   // bits set before each word; once sorted: ends of the cells
  std::span<std::uint32_t> cell_of_;  // of each point; while numbering: its word
  std::size_t size_ = 0;
  std::size_t cells_ = 0;
};

}  // namespace grapnel
