#pragma once

#include <string>
#include <vector>

#include "base/geometry.h"
#include "pipeline/features.h"
#include "pipeline/model.h"

namespace grapnel {

/// Which directions of a grasp must be known: translations x y z, rotations x y z.
struct RequiredDirections {
  bool direction[6] = {true, true, true, true, true, true};
};
/// Load time. Empty names: all, but not the axis about which the model turns freely.
[[nodiscard]] RequiredDirections required_directions(const std::vector<std::string>& names,
                                                     Symmetry symmetry);

/// Predicted covariance of a pose: residual variance times the inverse information, times the
/// number of readings that share an error (neighbouring pixels of structured light do).
[[nodiscard]] Mat6d pose_covariance(const RefinedPose& pose, double sigma_m,
                                    double readings_per_error) noexcept;

struct Uncertainty {
  double sigma_m = 0.0;    ///< 1-σ, weakest required translation
  double sigma_rad = 0.0;  ///< 1-σ, weakest required rotation
};
/// The covariance (at the camera's origin) carried to a frame at `camera_from_frame`.
[[nodiscard]] Uncertainty uncertainty_at(const Mat6d& covariance, const Pose& camera_from_frame,
                                         const RequiredDirections& required) noexcept;

}  // namespace grapnel
