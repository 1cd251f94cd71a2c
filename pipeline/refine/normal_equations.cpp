#include "pipeline/refine/normal_equations.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace grapnel {

Mat6d NormalEquations::matrix() const noexcept {
  Mat6d full;
  int k = 0;
  for (int a = 0; a < 6; ++a) {
    for (int b = a; b < 6; ++b) full(a, b) = full(b, a) = upper_[k++];
  }
  return full;
}

void NormalEquations::add_opposite(const NormalEquations& other, const Mat3d& rotation) noexcept {
  Mat6d turn = Mat6d::Zero();
  turn.topLeftCorner<3, 3>() = rotation;
  turn.bottomRightCorner<3, 3>() = rotation;
  const Mat6d full = turn * other.matrix() * turn.transpose();
  const Vec6d gradient = turn * Eigen::Map<const Vec6d>(other.gradient_);
  int k = 0;
  for (int a = 0; a < 6; ++a) {
    gradient_[a] -= gradient[a];
    for (int b = a; b < 6; ++b) upper_[k++] += full(a, b);
  }
  arm_square_ += other.arm_square_;
  weight_ += other.weight_;
}

Vec6d NormalEquations::solve(double freeze_ratio) const noexcept {
  if (!(weight_ > 0.0)) return Vec6d::Zero();
  const double arm_m = std::max(std::sqrt(arm_square_ / weight_), 1e-9);
  Vec6d scale;
  scale << 1.0, 1.0, 1.0, 1.0 / arm_m, 1.0 / arm_m, 1.0 / arm_m;
  const Mat6d scaled = scale.asDiagonal() * matrix() * scale.asDiagonal();
  Vec6d right;
  for (int a = 0; a < 6; ++a) right[a] = -gradient_[a] * scale[a];

  // No eigenvalue exceeds the largest row sum: where the matrix stays positive definite with that
  // share of it taken off the diagonal, no direction is left alone.
  const double bound = scaled.cwiseAbs().rowwise().sum().maxCoeff();
  const Mat6d reduced = scaled - Mat6d(freeze_ratio * bound * Mat6d::Identity());
  if (Eigen::LLT<Mat6d>(reduced).info() == Eigen::Success) {
    return scale.asDiagonal() * Eigen::LLT<Mat6d>(scaled).solve(right);
  }
  const Eigen::SelfAdjointEigenSolver<Mat6d> solver(scaled);
  const double smallest_kept = freeze_ratio * solver.eigenvalues()[5];
  Vec6d step = Vec6d::Zero();
  for (int i = 0; i < 6; ++i) {
    const double value = solver.eigenvalues()[i];
    if (!(value > smallest_kept) || !(value > 0.0)) continue;
    const Vec6d direction = solver.eigenvectors().col(i);
    step += direction * (direction.dot(right) / value);
  }
  return scale.asDiagonal() * step;
}

Mat6d NormalEquations::information_at_origin() const noexcept {
  Mat6d centre_from_origin = Mat6d::Identity();
  centre_from_origin.topRightCorner<3, 3>() = -skew(centre_);
  return centre_from_origin.transpose() * matrix() * centre_from_origin;
}

Pose moved(const Pose& pose, const Vec6d& step, const Vec3d& centre) noexcept {
  const Mat3d turn = rotation_from_vector(step.tail<3>());
  Pose result = Pose::Identity();
  // Through a unit quaternion, so that rounding never adds up to a scale.
  result.linear() = Eigen::Quaterniond(Mat3d(turn * pose.linear())).normalized().toRotationMatrix();
  result.translation() = turn * (pose.translation() - centre) + centre + step.head<3>();
  return result;
}

Mat6d information_of_inverse(const Mat6d& information, const Pose& pose) noexcept {
  Mat6d adjoint = Mat6d::Zero();
  adjoint.topLeftCorner<3, 3>() = pose.linear();
  adjoint.bottomRightCorner<3, 3>() = pose.linear();
  adjoint.topRightCorner<3, 3>() = skew(pose.translation()) * pose.linear();
  return adjoint.transpose() * information * adjoint;
}

Mat3d skew(const Vec3d& v) noexcept {
  Mat3d m;
  m << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return m;
}

}  // namespace grapnel
