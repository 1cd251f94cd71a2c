#include "pipeline/refine/closest_in_view.h"

#include <algorithm>

namespace grapnel {

Status ClosestInView::build(const Surface& view, int half_window_px) noexcept {
  const Intrinsics& camera = view.grid.intrinsics;
  if (!view.organised() || !(camera.fx > 0.0) || !(camera.fy > 0.0)) {
    return Error{Code::BadParameter, Stage::Refine, 0};
  }
  view_ = &view;
  half_ = std::max(0, half_window_px);
  fx_ = static_cast<float>(camera.fx);
  fy_ = static_cast<float>(camera.fy);
  // So that the conversion to an integer rounds.
  cx_ = static_cast<float>(camera.cx) + 0.5F;
  cy_ = static_cast<float>(camera.cy) + 0.5F;
  return {};
}

std::int32_t ClosestInView::closest(const Vec3f& p, float max_distance_m) const noexcept {
  if (!(p.z() > 0.0F)) return -1;
  const Surface::Grid& grid = view_->grid;
  const float column = fx_ * p.x() / p.z() + cx_;
  const float row = fy_ * p.y() / p.z() + cy_;
  if (!(column >= 0.0F && row >= 0.0F && column < static_cast<float>(grid.width) &&
        row < static_cast<float>(grid.height))) {
    return -1;
  }
  const int u = static_cast<int>(column);
  const int v = static_cast<int>(row);
  std::int32_t best = -1;
  float best_square = max_distance_m * max_distance_m;
  for (int y = std::max(0, v - half_); y <= std::min(grid.height - 1, v + half_); ++y) {
    for (int x = std::max(0, u - half_); x <= std::min(grid.width - 1, u + half_); ++x) {
      const std::int32_t point = grid.point_of[static_cast<std::size_t>(y * grid.width + x)];
      if (point < 0) continue;
      const float square = (view_->point(static_cast<std::size_t>(point)) - p).squaredNorm();
      if (square > best_square || (square == best_square && best >= 0)) continue;
      best_square = square;
      best = point;
    }
  }
  return best;
}

}  // namespace grapnel
