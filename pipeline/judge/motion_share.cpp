#include "pipeline/judge/motion_share.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>

namespace grapnel {
namespace {

// What notices a motion less than this share of the best noticed one does so by the noise of its
// normals: 8 degrees, squared.
constexpr double kUnnoticed = 0.02;

}  // namespace

MotionSums::MotionSums(const Vec3d& centre, double arm_m) noexcept
    : centre_(centre.cast<float>()), per_arm_(static_cast<float>(1.0 / arm_m)) {}

void MotionSums::add(const Vec3f& point, const Vec3f& normal) noexcept {
  const Vec3f turn = (per_arm_ * (point - centre_)).cross(normal);
  const std::array<float, 6> row = {normal.x(), normal.y(), normal.z(),
                                    turn.x(),   turn.y(),   turn.z()};
  std::size_t at = 0;
  for (std::size_t i = 0; i < row.size(); ++i) {
    for (std::size_t j = i; j < row.size(); ++j) {
      upper_[at++] += static_cast<double>(row[i] * row[j]);
    }
  }
}

void MotionSums::add(const MotionSums& other) noexcept {
  for (std::size_t i = 0; i < kUpper; ++i) upper_[i] += other.upper_[i];
}

Mat6d MotionSums::matrix() const noexcept {
  Mat6d matrix;
  std::size_t at = 0;
  for (Eigen::Index i = 0; i < 6; ++i) {
    for (Eigen::Index j = i; j < 6; ++j) matrix(i, j) = matrix(j, i) = upper_[at++];
  }
  return matrix;
}

double least_matched_share(const MotionSums& part, const MotionSums& all) noexcept {
  Mat6d whole = all.matrix();
  Mat6d matched = part.matrix();
  const double most = whole.diagonal().maxCoeff();
  if (!(most > 0.0)) return 0.0;
  whole.diagonal().array() += kUnnoticed * most;
  matched.diagonal().array() += kUnnoticed * most;
  const Eigen::LLT<Mat6d> root(whole);
  Mat6d relative = root.matrixL().solve(matched);
  relative = root.matrixL().solve(relative.transpose().eval());
  const Eigen::SelfAdjointEigenSolver<Mat6d> solver(relative, Eigen::EigenvaluesOnly);
  return std::clamp(solver.eigenvalues()[0], 0.0, 1.0);
}

}  // namespace grapnel
