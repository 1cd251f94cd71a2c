#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "base/arena.h"
#include "pipeline/kernels/within.h"
#include "pipeline/surface.h"

namespace grapnel {

/// A cloud sorted into cubic cells (counting sort): a row of cells along x is one stretch.
class CellIndex {
 public:
  void reserve(Arena& arena, std::size_t max_points);
  /// `edge_m` is widened when the cloud spans more cells than there is memory for. O(n + cells).
  void build(const Surface& surface, double edge_m) noexcept;

  /// Cells that hold every point within `radius_m` of `place`; rows through `stretch`.
  struct Box {
    std::array<int, 3> low{};
    std::array<int, 3> high{-1, -1, -1};  ///< inclusive
  };
  [[nodiscard]] Box box(const Vec3f& place, float radius_m) const noexcept {
    return box(place, place, radius_m);
  }
  /// The same of any place between two corners.
  [[nodiscard]] Box box(const Vec3f& low, const Vec3f& high, float radius_m) const noexcept;
  [[nodiscard]] PointRange stretch(const Box& box, int cell_y, int cell_z) const noexcept {
    const std::ptrdiff_t row = (static_cast<std::ptrdiff_t>(cell_z) * dims_[1] + cell_y) * dims_[0];
    return {begin_[static_cast<std::size_t>(row + box.low[0])],
            begin_[static_cast<std::size_t>(row + box.high[0] + 1)]};
  }

  /// Index of the point at a position of the cells' order.
  [[nodiscard]] std::span<const std::int32_t> order() const noexcept { return order_; }
  [[nodiscard]] std::int32_t point(std::int32_t position) const noexcept {
    return order_[static_cast<std::size_t>(position)];
  }

 private:
  void fit_cells(const Surface& surface, double edge_m) noexcept;
  [[nodiscard]] int cell_along(float value, std::size_t axis) const noexcept;

  std::span<std::int32_t> begin_;  ///< first position of each cell, one more at the end
  std::span<std::int32_t> order_;
  std::span<std::int32_t> cell_of_;
  std::array<float, 3> low_{};
  std::array<int, 3> dims_{1, 1, 1};
  float inverse_edge_ = 0.0F;
};

}  // namespace grapnel
