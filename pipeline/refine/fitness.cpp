#include "pipeline/refine/fitness.h"

#include <cmath>
#include <limits>

namespace grapnel {

Fitness fitness(const Surface& moving, const Surface& fixed, const ClosestSurface& closest,
                const Pose& fixed_from_moving, float max_distance_m) noexcept {
  const Eigen::Matrix3f rotation = fixed_from_moving.linear().cast<float>();
  const Vec3f shift = fixed_from_moving.translation().cast<float>();
  Fitness result;
  double squares = 0.0;
  for (std::size_t i = 0; i < moving.size; ++i) {
    const Vec3f p = rotation * moving.point(i) + shift;
    const std::int32_t found = closest.closest(p, max_distance_m);
    if (found < 0) continue;
    const Vec3d gap = (fixed.point(static_cast<std::size_t>(found)) - p).cast<double>();
    squares += gap.squaredNorm();
    ++result.inliers;
  }
  if (result.inliers == 0) return result;
  result.inlier_ratio = static_cast<double>(result.inliers) / static_cast<double>(moving.size);
  result.rmse_m = std::sqrt(squares / static_cast<double>(result.inliers));
  return result;
}

double pcl_fitness_score(const Surface& moving, const Surface& fixed, const ClosestSurface& closest,
                         const Pose& fixed_from_moving, double max_range) noexcept {
  const auto distance_m = static_cast<float>(std::sqrt(max_range));
  const Fitness near = fitness(moving, fixed, closest, fixed_from_moving, distance_m);
  if (near.inliers == 0) return std::numeric_limits<double>::infinity();
  return near.rmse_m * near.rmse_m;
}

}  // namespace grapnel
