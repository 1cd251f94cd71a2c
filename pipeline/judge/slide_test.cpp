#include "pipeline/judge/slide_test.h"

#include <Eigen/Eigenvalues>
#include <algorithm>

#include "pipeline/refine/normal_equations.h"

namespace grapnel {
namespace {

constexpr int kWeakest = 2;

/// Information about (translation, rotation × arm) with the rotation taken about `centre`.
Mat6d about(const Vec3d& centre, double arm_m, const Mat6d& at_origin) noexcept {
  Mat6d origin_from_centre = Mat6d::Identity();
  origin_from_centre.topRightCorner<3, 3>() = skew(centre);
  Vec6d scale;
  scale << 1.0, 1.0, 1.0, 1.0 / arm_m, 1.0 / arm_m, 1.0 / arm_m;
  const Mat6d moved = origin_from_centre.transpose() * at_origin * origin_from_centre;
  return scale.asDiagonal() * moved * scale.asDiagonal();
}

}  // namespace

double slide_margin(const OverlapView& source, const OverlapView& target,
                    const Pose& target_from_source, const Mat6d& information, const Vec3d& centre,
                    double arm_m, double step_m, const OverlapTolerance& tolerance) noexcept {
  const auto worth_at = [&](const Pose& pose) {
    return worth(test_overlap(source, target, pose, tolerance),
                 test_overlap(target, source, pose.inverse(), tolerance));
  };
  const double best = worth_at(target_from_source);
  if (!(best > 0.0)) return 0.0;
  const Eigen::SelfAdjointEigenSolver<Mat6d> solver(about(centre, arm_m, information));
  double margin = 1.0;
  for (int k = 0; k < kWeakest; ++k) {
    Vec6d step = step_m * solver.eigenvectors().col(k);
    step.tail<3>() /= arm_m;
    for (const double sign : {1.0, -1.0}) {
      const Pose slid = moved(target_from_source, sign * step, centre);
      margin = std::min(margin, 1.0 - std::max(0.0, worth_at(slid)) / best);
    }
  }
  return std::max(0.0, margin);
}

}  // namespace grapnel
