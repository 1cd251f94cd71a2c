#pragma once

#include <string>
#include <vector>

#include "base/geometry.h"
#include "pipeline/features.h"
#include "pipeline/judge/pose_information.h"
#include "pipeline/model.h"

namespace grapnel {

/// Which directions of a grasp must be known: translations x y z, rotations x y z.
struct RequiredDirections {
  bool direction[6] = {true, true, true, true, true, true};
};
/// Load time. Empty names: all, but not the axis about which the model turns freely.
[[nodiscard]] RequiredDirections required_directions(const std::vector<std::string>& names,
                                                     Symmetry symmetry);

/// Errors of a camera's readings, metres at the part's distance.
struct ReadingErrors {
  double sigma_m = 0.0;             ///< of one reading, along the view
  double readings_per_error = 1.0;  ///< that share it: neighbouring pixels of structured light do
  double common_lateral_m = 0.0;    ///< across the view, shared by all of a part's outline
  double common_depth_m = 0.0;      ///< along the view, shared by all of a part
};

/// Predicted covariance of a pose: a reading's variance times the inverse information, times the
/// number of readings that share an error; and what no number of readings averages out.
[[nodiscard]] Mat6d pose_covariance(const Mat6d& information, const ReadingErrors& errors) noexcept;

/// The same of readings whose variance the information holds already. The inverse information
/// carries their sums to shifts of the pose: `common`, of errors that many share, for
/// `common_sigma` of each; `rounding`; and `misfit`. Where the pose is not the one that the
/// readings fit best, nobody knows which errs.
[[nodiscard]] Mat6d pose_covariance(const PoseReadings& readings,
                                    const Vec3d& common_sigma) noexcept;

/// Takes a turn about the line through `point` along `axis` (target frame) for known, as nothing
/// depends on it: what little of it was measured must not reach the other directions.
void take_turn_as_known(const Vec3d& point, const Vec3d& axis, Mat6d& information) noexcept;

struct Uncertainty {
  double sigma_m = 0.0;    ///< 1-σ, weakest required translation
  double sigma_rad = 0.0;  ///< 1-σ, weakest required rotation
};
/// The covariance (at the camera's origin) carried to a frame at `camera_from_frame`.
[[nodiscard]] Uncertainty uncertainty_at(const Mat6d& covariance, const Pose& camera_from_frame,
                                         const RequiredDirections& required) noexcept;

}  // namespace grapnel
