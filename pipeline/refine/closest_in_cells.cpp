#include "pipeline/refine/closest_in_cells.h"

#include <algorithm>

#include "pipeline/preprocess/compact.h"

namespace grapnel {

void ClosestInCells::reserve(Arena& arena, std::size_t max_points) {
  cells_.reserve(arena, max_points);
  for (std::span<float>* plane : {&x_, &y_, &z_}) *plane = arena.take<float>(max_points);
}

Status ClosestInCells::build(const Surface& surface, double typical_m) noexcept {
  if (const Status status = check_points(surface, x_.size(), Stage::Refine); !status.ok()) {
    return status;
  }
  step_m_ = static_cast<float>(std::max(typical_m, 1e-9));
  cells_.build(surface, static_cast<double>(step_m_));
  for (std::size_t i = 0; i < surface.size; ++i) {
    const auto from = static_cast<std::size_t>(cells_.order()[i]);
    x_[i] = surface.x[from];
    y_[i] = surface.y[from];
    z_[i] = surface.z[from];
  }
  return {};
}

std::int32_t ClosestInCells::closest(const Vec3f& p, float max_distance_m) const noexcept {
  float radius = std::min(0.5F * step_m_, max_distance_m);
  for (;;) {
    float best_square = radius * radius;
    std::int32_t best = -1;
    const CellIndex::Box box = cells_.box(p, radius);
    for (int cell_z = box.low[2]; cell_z <= box.high[2]; ++cell_z) {
      for (int cell_y = box.low[1]; cell_y <= box.high[1]; ++cell_y) {
        const PointRange range = cells_.stretch(box, cell_y, cell_z);
        for (std::int32_t i = range.begin; i < range.end; ++i) {
          const auto k = static_cast<std::size_t>(i);
          const float dx = x_[k] - p.x();
          const float dy = y_[k] - p.y();
          const float dz = z_[k] - p.z();
          const float square = dx * dx + dy * dy + dz * dz;
          if (!(square <= best_square)) continue;
          const std::int32_t point = cells_.order()[k];
          // Of equally near ones the first, whatever the cells.
          if (square == best_square && best >= 0 && point > best) continue;
          best_square = square;
          best = point;
        }
      }
    }
    if (best >= 0 || !(radius < max_distance_m)) return best;
    radius = std::min(2.0F * radius, max_distance_m);
  }
}

}  // namespace grapnel
