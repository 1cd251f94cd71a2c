#pragma once

#include "base/geometry.h"

namespace grapnel {

/// Sums from which the rigid motion that best carries source points onto target points follows.
struct PointPairSums {
  double weight = 0.0;
  Vec3d source = Vec3d::Zero();
  Vec3d target = Vec3d::Zero();
  Mat3d cross = Mat3d::Zero();  ///< Σ w source targetᵀ

  void add(const Vec3d& source_point, const Vec3d& target_point, double w = 1.0) noexcept {
    weight += w;
    source += w * source_point;
    target += w * target_point;
    cross += w * source_point * target_point.transpose();
  }
};

/// target_from_source with the least weighted sum of squares: Horn 1987, the unit quaternion of the
/// largest eigenvalue of the 4×4 matrix of cross-covariances. Always a proper rotation.
[[nodiscard]] Pose best_rigid_motion(const PointPairSums& sums) noexcept;

}  // namespace grapnel
