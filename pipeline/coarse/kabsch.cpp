#include "pipeline/coarse/kabsch.h"

#include <Eigen/Eigenvalues>

namespace grapnel {

Pose best_rigid_motion(const PointPairSums& sums) noexcept {
  const double inverse = 1.0 / sums.weight;
  const Vec3d source = sums.source * inverse;
  const Vec3d target = sums.target * inverse;
  const Mat3d s = sums.cross * inverse - source * target.transpose();

  // Horn 1987, section 4.A.
  Mat4d n;
  n(0, 0) = s(0, 0) + s(1, 1) + s(2, 2);
  n(1, 1) = s(0, 0) - s(1, 1) - s(2, 2);
  n(2, 2) = s(1, 1) - s(0, 0) - s(2, 2);
  n(3, 3) = s(2, 2) - s(0, 0) - s(1, 1);
  n(0, 1) = n(1, 0) = s(1, 2) - s(2, 1);
  n(0, 2) = n(2, 0) = s(2, 0) - s(0, 2);
  n(0, 3) = n(3, 0) = s(0, 1) - s(1, 0);
  n(1, 2) = n(2, 1) = s(0, 1) + s(1, 0);
  n(1, 3) = n(3, 1) = s(2, 0) + s(0, 2);
  n(2, 3) = n(3, 2) = s(1, 2) + s(2, 1);
  const Eigen::SelfAdjointEigenSolver<Mat4d> solver(n);
  const Eigen::Vector4d q = solver.eigenvectors().col(3);

  Pose pose = Pose::Identity();
  pose.linear() = Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized().toRotationMatrix();
  pose.translation() = target - pose.linear() * source;
  return pose;
}

}  // namespace grapnel
