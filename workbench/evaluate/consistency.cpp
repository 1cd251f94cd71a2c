#include "workbench/evaluate/consistency.h"

#include <limits>

#include "pipeline/refine/normal_equations.h"

namespace grapnel {
namespace {

Vec3d centre_of(std::span<const Vec3f> points) {
  Vec3d sum = Vec3d::Zero();
  for (const Vec3f& point : points) sum += point.cast<double>();
  return points.empty() ? sum : Vec3d(sum / static_cast<double>(points.size()));
}

}  // namespace

std::array<double, 6> normalised_squared_errors(const Pose& found, const Pose& truth,
                                                const Mat6d& covariance, Symmetry symmetry,
                                                std::span<const Vec3f> source_points) {
  const Vec3d centre = centre_of(source_points);
  const Mat3d axes = found.linear().transpose();
  const Mat3d turn = truth.linear() * axes;
  // Half the antisymmetric part of a turn is its axis times the sine of its angle.
  const Vec3d omega =
      0.5 * Vec3d(turn(2, 1) - turn(1, 2), turn(0, 2) - turn(2, 0), turn(1, 0) - turn(0, 1));
  Eigen::Matrix<double, 6, 1> error;
  error << axes * (truth * centre - found * centre), axes * omega;
  // A point p moves by t + ω × p.
  Mat6d frame_from_origin = Mat6d::Zero();
  frame_from_origin.topLeftCorner<3, 3>() = axes;
  frame_from_origin.topRightCorner<3, 3>() = -axes * skew(found * centre);
  frame_from_origin.bottomRightCorner<3, 3>() = axes;
  const Mat6d local = frame_from_origin * covariance * frame_from_origin.transpose();
  std::array<double, 6> result{};
  for (int i = 0; i < 6; ++i) {
    result[static_cast<std::size_t>(i)] = i == 3 + free_axis(symmetry) && i > 2
                                              ? std::numeric_limits<double>::quiet_NaN()
                                              : error[i] * error[i] / local(i, i);
  }
  return result;
}

}  // namespace grapnel
