#include "pipeline/coarse/kabsch.h"

#include <gtest/gtest.h>

#include "base/rng.h"

namespace grapnel {
namespace {

Pose pose_of(const Vec3d& rotation_rad, const Vec3d& shift_m) {
  Pose pose = Pose::Identity();
  pose.linear() = rotation_from_vector(rotation_rad);
  pose.translation() = shift_m;
  return pose;
}

TEST(Kabsch, FindsTheMotionThatMovedThePoints) {
  Rng rng(5);
  for (int round = 0; round < 50; ++round) {
    const Pose truth = pose_of(Vec3d(rng.uniform(-3, 3), rng.uniform(-3, 3), rng.uniform(-3, 3)),
                               Vec3d(rng.uniform(-9, 9), rng.uniform(-9, 9), rng.uniform(-9, 9)));
    PointPairSums sums;
    for (int i = 0; i < 8; ++i) {
      const Vec3d p(rng.uniform(-1, 1), rng.uniform(-1, 1), rng.uniform(-1, 1));
      sums.add(p, truth * p, rng.uniform(0.5, 2.0));
    }
    const Pose found = best_rigid_motion(sums);
    EXPECT_LT((found.matrix() - truth.matrix()).cwiseAbs().maxCoeff(), 1e-9);
  }
}

TEST(Kabsch, NeverMirrors) {
  // The image of a right-handed set in a mirror: the best proper rotation still has determinant 1.
  PointPairSums sums;
  for (const Vec3d& p : {Vec3d(1, 0, 0), Vec3d(0, 2, 0), Vec3d(0, 0, 3), Vec3d(-1, -1, 1)}) {
    sums.add(p, Vec3d(p.x(), p.y(), -p.z()));
  }
  EXPECT_NEAR(best_rigid_motion(sums).linear().determinant(), 1.0, 1e-12);
}

TEST(Kabsch, ThreePointsInAPlaneAreEnough) {
  const Pose truth = pose_of(Vec3d(0.3, -0.4, 2.0), Vec3d(0.1, 0.2, 0.3));
  PointPairSums sums;
  for (const Vec3d& p : {Vec3d(0, 0, 0), Vec3d(0.2, 0, 0), Vec3d(0, 0.1, 0)}) {
    sums.add(p, truth * p);
  }
  EXPECT_LT((best_rigid_motion(sums).matrix() - truth.matrix()).cwiseAbs().maxCoeff(), 1e-9);
}

}  // namespace
}  // namespace grapnel
