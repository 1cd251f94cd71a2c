#pragma once

#include <cstddef>

#include "pipeline/stage.h"

namespace grapnel {

/// How well a surface lies on another at a pose. Says nothing of what was not seen: a judge
/// decides.
struct Fitness {
  double inlier_ratio = 0.0;  ///< share of the moving points with a partner within the distance
  double rmse_m = 0.0;        ///< root of the mean squared distance of those to their partners
  std::size_t inliers = 0;
};
/// With partners within `max_distance_m`. O(points).
[[nodiscard]] Fitness fitness(const Surface& moving, const Surface& fixed,
                              const ClosestSurface& closest, const Pose& fixed_from_moving,
                              float max_distance_m) noexcept;

/// PCL's getFitnessScore(max_range): mean squared distance, m², of the points whose squared
/// distance is at most `max_range`, a number that PCL compares with the square although it is
/// called a distance. Infinite when there is none, where PCL says the largest number.
[[nodiscard]] double pcl_fitness_score(const Surface& moving, const Surface& fixed,
                                       const ClosestSurface& closest, const Pose& fixed_from_moving,
                                       double max_range) noexcept;

}  // namespace grapnel
