#include "pipeline/judge/covariance.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>

#include "pipeline/refine/normal_equations.h"

namespace grapnel {
namespace {

// Below this share of the strongest direction nothing was measured; keeps the inverse finite.
constexpr double kLeastInformation = 1e-9;

Mat6d inverse_of(const Mat6d& information) noexcept {
  Mat6d finite = information;
  const double strongest = finite.diagonal().maxCoeff();
  finite.diagonal().array() += std::max(kLeastInformation * strongest, 1e-12);
  const Mat6d inverse = finite.ldlt().solve(Mat6d::Identity());
  return 0.5 * (inverse + inverse.transpose());
}

}  // namespace

RequiredDirections required_directions(const std::vector<std::string>& names, Symmetry symmetry) {
  static constexpr std::array<const char*, 6> kNames = {"x", "y", "z", "rx", "ry", "rz"};
  RequiredDirections required;
  if (!names.empty()) {
    for (std::size_t i = 0; i < kNames.size(); ++i) {
      required.direction[i] = std::find(names.begin(), names.end(), kNames[i]) != names.end();
    }
    return required;
  }
  if (const int axis = free_axis(symmetry); axis >= 0) required.direction[3 + axis] = false;
  return required;
}

Mat6d pose_covariance(const Mat6d& information, const ReadingErrors& errors) noexcept {
  const double variance = errors.sigma_m * errors.sigma_m * errors.readings_per_error;
  Mat6d covariance = variance * inverse_of(information);
  const double lateral = errors.common_lateral_m * errors.common_lateral_m;
  covariance(0, 0) += lateral;
  covariance(1, 1) += lateral;
  covariance(2, 2) += errors.common_depth_m * errors.common_depth_m;
  return covariance;
}

Mat6d pose_covariance(const PoseReadings& readings, const Vec3d& common_sigma) noexcept {
  const Mat6d inverse = inverse_of(readings.information);
  const Vec6d off = inverse * readings.misfit;
  const Eigen::Matrix<double, 6, 3> shift = inverse * readings.common * common_sigma.asDiagonal();
  const Mat6d rounding = inverse * readings.rounding * inverse;
  return inverse + shift * shift.transpose() + 0.5 * (rounding + rounding.transpose()) +
         off * off.transpose();
}

void take_turn_as_known(const Vec3d& point, const Vec3d& axis, Mat6d& information) noexcept {
  // The motion of a turn ω about the line: at the origin it shifts by point × ω.
  Vec6d turn;
  turn << point.cross(axis), axis;
  information += information.diagonal().maxCoeff() * turn * turn.transpose();
}

Uncertainty uncertainty_at(const Mat6d& covariance, const Pose& camera_from_frame,
                           const RequiredDirections& required) noexcept {
  // A point g moves by t + ω × g; then expressed along the frame's axes.
  Mat6d frame_from_origin = Mat6d::Zero();
  const Mat3d axes = camera_from_frame.linear().transpose();
  frame_from_origin.topLeftCorner<3, 3>() = axes;
  frame_from_origin.topRightCorner<3, 3>() = -axes * skew(camera_from_frame.translation());
  frame_from_origin.bottomRightCorner<3, 3>() = axes;
  const Mat6d local = frame_from_origin * covariance * frame_from_origin.transpose();
  Uncertainty result;
  for (int i = 0; i < 3; ++i) {
    if (required.direction[i]) {
      result.sigma_m = std::max(result.sigma_m, std::sqrt(std::max(0.0, local(i, i))));
    }
    if (required.direction[i + 3]) {
      result.sigma_rad = std::max(result.sigma_rad, std::sqrt(std::max(0.0, local(i + 3, i + 3))));
    }
  }
  return result;
}

}  // namespace grapnel
