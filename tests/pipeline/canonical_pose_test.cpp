#include <gtest/gtest.h>

#include <cmath>

#include "base/math.h"
#include "base/rng.h"
#include "pipeline/model.h"

namespace grapnel {
namespace {

Pose turned_about(const Pose& pose, const Vec3d& axis, double angle_rad) {
  Pose result = pose;
  result.linear() = pose.linear() * rotation_from_vector(axis * angle_rad);
  return result;
}

/// A part lying below a camera that looks down: its z axis points to the camera.
Pose lying(double yaw_rad) {
  Pose pose = Pose::Identity();
  pose.linear() =
      rotation_from_vector({math::kPi, 0.0, 0.0}) * rotation_from_vector({0.0, 0.0, yaw_rad});
  pose.translation() = Vec3d(0.1, -0.05, 1.0);
  return pose;
}

/// On top, z into the part.
Pose top_grasp() {
  Pose pose = Pose::Identity();
  pose.linear() = rotation_from_vector({math::kPi, 0.0, 0.0});
  pose.translation() = Vec3d(0.0, 0.0, 0.1);
  return pose;
}

// Rounding of a few products of rotations.
constexpr double kTolerance = 1e-9;

TEST(CanonicalPose, OfABoxIsTheSameFromAllOfItsEquivalents) {
  for (const double yaw_rad : {-2.5, -1.0, 0.2, 1.3, 3.0}) {
    const Pose pose = lying(yaw_rad);
    const Pose expected = canonical_pose(pose, top_grasp(), Symmetry::Box);
    for (int axis = 0; axis < 3; ++axis) {
      const Pose other = turned_about(pose, Vec3d::Unit(axis), math::kPi);
      const Pose found = canonical_pose(other, top_grasp(), Symmetry::Box);
      EXPECT_LT((found.matrix() - expected.matrix()).cwiseAbs().maxCoeff(), kTolerance) << yaw_rad;
    }
  }
}

TEST(CanonicalPose, PutsTheGraspOnTheSideOfTheCamera) {
  const Pose upside_down = turned_about(lying(0.7), Vec3d::UnitX(), math::kPi);
  const Pose found = canonical_pose(upside_down, top_grasp(), Symmetry::Box);
  const Pose camera_from_grasp = found * top_grasp();
  // The box's middle is 1 m away, its upper face 0.1 m nearer; the gripper moves away from the
  // camera.
  EXPECT_NEAR(camera_from_grasp.translation().z(), 0.9, kTolerance);
  EXPECT_NEAR(camera_from_grasp.linear()(2, 2), 1.0, kTolerance);
}

TEST(CanonicalPose, KeepsTheGraspOnTopWhateverTheHeading) {
  // Upside down turns the frame by half a turn, and so does a heading of half a turn.
  for (const double yaw_rad : {3.0, math::kPi, -3.0}) {
    for (const Symmetry symmetry : {Symmetry::X180, Symmetry::Y180, Symmetry::AxisZFlip}) {
      const Pose found = canonical_pose(lying(yaw_rad), top_grasp(), symmetry);
      EXPECT_NEAR((found * top_grasp()).translation().z(), 0.9, kTolerance) << yaw_rad;
    }
  }
}

TEST(CanonicalPose, OfABarrelDoesNotDependOnTheSpinThatWasFound) {
  const Pose expected = canonical_pose(lying(0.0), top_grasp(), Symmetry::AxisZ);
  for (const double spin_rad : {0.4, 1.9, -2.2, 3.1}) {
    const Pose found = canonical_pose(lying(spin_rad), top_grasp(), Symmetry::AxisZ);
    EXPECT_LT((found.matrix() - expected.matrix()).cwiseAbs().maxCoeff(), kTolerance) << spin_rad;
  }
}

TEST(CanonicalPose, WithoutSymmetryIsThePoseItself) {
  const Pose pose = lying(1.1);
  EXPECT_EQ(canonical_pose(pose, top_grasp(), Symmetry::None).matrix(), pose.matrix());
}

}  // namespace
}  // namespace grapnel
