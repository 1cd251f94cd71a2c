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
  if (symmetry == Symmetry::AxisX) required.direction[3] = false;
  if (symmetry == Symmetry::AxisY) required.direction[4] = false;
  if (symmetry == Symmetry::AxisZ || symmetry == Symmetry::AxisZFlip) required.direction[5] = false;
  return required;
}

Mat6d pose_covariance(const RefinedPose& pose, double sigma_m, double readings_per_error) noexcept {
  const double variance = sigma_m * sigma_m * readings_per_error;
  Mat6d information = pose.information;
  const double strongest = information.diagonal().maxCoeff();
  information.diagonal().array() += std::max(kLeastInformation * strongest, 1e-12);
  const Mat6d inverse = information.ldlt().solve(Mat6d::Identity());
  return variance * 0.5 * (inverse + inverse.transpose());
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
