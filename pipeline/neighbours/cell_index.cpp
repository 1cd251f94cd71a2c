#include "pipeline/neighbours/cell_index.h"

#include <algorithm>
#include <cmath>

namespace grapnel {

namespace {

/// Memory for cells per point: a surface fills far fewer of its box's cells.
constexpr std::size_t kCellsPerPoint = 8;

}  // namespace

void CellIndex::reserve(Arena& arena, std::size_t max_points) {
  begin_ = arena.take<std::int32_t>(kCellsPerPoint * max_points + 2);
  order_ = arena.take<std::int32_t>(max_points);
  cell_of_ = arena.take<std::int32_t>(max_points);
}

int CellIndex::cell_along(float value, std::size_t axis) const noexcept {
  // In double and clamped before the cast: a far place must not overflow an int.
  const double cell = (static_cast<double>(value) - static_cast<double>(low_[axis])) *
                      static_cast<double>(inverse_edge_);
  // What is no number goes to the first cell: nothing is found near it.
  return cell > 0.0 ? static_cast<int>(std::min(cell, static_cast<double>(dims_[axis] - 1))) : 0;
}

void CellIndex::fit_cells(const Surface& surface, double edge_m) noexcept {
  const std::array<std::span<float>, 3> planes = {surface.x, surface.y, surface.z};
  std::array<double, 3> extent{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto [low, high] = std::minmax_element(
        planes[axis].begin(), planes[axis].begin() + static_cast<std::ptrdiff_t>(surface.size));
    low_[axis] = *low;
    extent[axis] = static_cast<double>(*high) - static_cast<double>(*low);
  }
  const auto room = static_cast<double>(begin_.size() - 1);
  double edge = std::max(edge_m, 1e-12);
  double cells = 0.0;
  // Each round grows the edge by a tenth; the product of the dimensions falls below any room >= 1.
  for (;; edge *= 1.1) {
    cells = 1.0;
    for (std::size_t axis = 0; axis < 3; ++axis) cells *= std::floor(extent[axis] / edge) + 2.0;
    if (cells <= room || edge > 1e12) break;
  }
  for (std::size_t axis = 0; axis < 3; ++axis) {
    dims_[axis] = static_cast<int>(std::floor(extent[axis] / edge)) + 2;
  }
  if (cells > room) dims_ = {1, 1, 1};
  inverse_edge_ = static_cast<float>(1.0 / edge);
}

void CellIndex::build(const Surface& surface, double edge_m) noexcept {
  fit_cells(surface, edge_m);
  const std::size_t cells = static_cast<std::size_t>(dims_[0]) *
                            static_cast<std::size_t>(dims_[1]) * static_cast<std::size_t>(dims_[2]);
  std::fill_n(begin_.begin(), cells + 1, 0);
  for (std::size_t i = 0; i < surface.size; ++i) {
    const int cell =
        (cell_along(surface.z[i], 2) * dims_[1] + cell_along(surface.y[i], 1)) * dims_[0] +
        cell_along(surface.x[i], 0);
    cell_of_[i] = cell;
    ++begin_[static_cast<std::size_t>(cell) + 1];
  }
  for (std::size_t cell = 0; cell < cells; ++cell) begin_[cell + 1] += begin_[cell];
  // Filling from the last point back moves each cell's end to its begin and keeps index order.
  for (std::size_t i = surface.size; i-- > 0;) {
    const auto slot = static_cast<std::size_t>(cell_of_[i]) + 1;
    order_[static_cast<std::size_t>(--begin_[slot])] = static_cast<std::int32_t>(i);
  }
  // begin_[c + 1] is now where cell c begins; shift down by one.
  for (std::size_t cell = 0; cell < cells; ++cell) begin_[cell] = begin_[cell + 1];
  begin_[cells] = static_cast<std::int32_t>(surface.size);
}

CellIndex::Box CellIndex::box(const Vec3f& low, const Vec3f& high, float radius_m) const noexcept {
  Box box;
  const float r = radius_m * 1.00001F;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    box.low[axis] = cell_along(low[static_cast<Eigen::Index>(axis)] - r, axis);
    box.high[axis] = cell_along(high[static_cast<Eigen::Index>(axis)] + r, axis);
  }
  return box;
}

}  // namespace grapnel
