#include "workbench/evaluate/pose_error.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <vector>

#include "base/math.h"
#include "base/rng.h"

namespace grapnel {
namespace {

constexpr double kTolerance = 1e-12;  // a few rounding errors of double at metre scale

Pose turned(const Vec3d& rotation_rad, const Vec3d& shift_m) {
  Pose pose = Pose::Identity();
  pose.linear() = rotation_from_vector(rotation_rad);
  pose.translation() = shift_m;
  return pose;
}

std::vector<Vec3f> box_points() {
  Rng rng(5);
  std::vector<Vec3f> points;
  for (int i = 0; i < 200; ++i) {
    points.emplace_back(static_cast<float>(rng.uniform(-0.2, 0.2)),
                        static_cast<float>(rng.uniform(-0.1, 0.1)),
                        static_cast<float>(rng.uniform(-0.05, 0.05)));
  }
  return points;
}

const Pose kTruth = turned({0.3, -1.1, 0.7}, {0.1, 0.2, 1.4});

TEST(PoseErrorOf, AShiftIsItsLength) {
  const Pose found = turned({0.0, 0.0, 0.0}, {0.003, 0.0, 0.004}) * kTruth;
  const PoseError error = pose_error(found, kTruth, Symmetry::None, box_points());
  EXPECT_NEAR(error.mean_displacement_m, 0.005, kTolerance);
  EXPECT_NEAR(error.rotation_rad, 0.0, 1e-7);  // an angle near 0 comes from a square root
}

TEST(PoseErrorOf, ATurnAboutAnAxisMovesAPointByItsChord) {
  const std::array<Vec3f, 1> points = {Vec3f(0.5F, 0.0F, 0.0F)};
  const Pose found = kTruth * turned({0.0, 0.0, 0.2}, Vec3d::Zero());
  const PoseError error = pose_error(found, kTruth, Symmetry::None, points);
  EXPECT_NEAR(error.mean_displacement_m, 2.0 * 0.5 * std::sin(0.1), kTolerance);
  EXPECT_NEAR(error.rotation_rad, 0.2, 1e-9);
}

TEST(PoseErrorOf, ADeclaredHalfTurnIsNoError) {
  const Pose found = kTruth * turned({0.0, 0.0, math::kPi}, Vec3d::Zero());
  for (const Symmetry symmetry : {Symmetry::Z180, Symmetry::Box, Symmetry::AxisZ}) {
    const PoseError error = pose_error(found, kTruth, symmetry, box_points());
    EXPECT_NEAR(error.mean_displacement_m, 0.0, 1e-9);
    EXPECT_NEAR(error.rotation_rad, 0.0, 1e-6);
  }
  EXPECT_GT(pose_error(found, kTruth, Symmetry::X180, box_points()).rotation_rad, 3.0);
  EXPECT_GT(pose_error(found, kTruth, Symmetry::None, box_points()).rotation_rad, 3.0);
}

TEST(PoseErrorOf, AFreeRotationLeavesOnlyTheTilt) {
  const Vec3d tilt_rad(0.02, 0.0, 0.0);
  const std::array<std::pair<Symmetry, Vec3d>, 3> cases = {{
      {Symmetry::AxisX, Vec3d::UnitX()},
      {Symmetry::AxisY, Vec3d::UnitY()},
      {Symmetry::AxisZ, Vec3d::UnitZ()},
  }};
  for (const auto& [symmetry, axis] : cases) {
    const Vec3d across_rad = 0.02 * axis.unitOrthogonal();
    const Pose found =
        kTruth * turned(across_rad, Vec3d::Zero()) * turned(2.3 * axis, Vec3d::Zero());
    EXPECT_NEAR(pose_error(found, kTruth, symmetry, box_points()).rotation_rad, tilt_rad.norm(),
                1e-9);
  }
}

TEST(PoseErrorOf, EndForEndCountsOnlyWhereDeclared) {
  const Pose found = kTruth * turned({0.0, 0.0, 1.2}, Vec3d::Zero()) *
                     turned({math::kPi, 0.0, 0.0}, Vec3d::Zero());
  EXPECT_NEAR(pose_error(found, kTruth, Symmetry::AxisZFlip, box_points()).rotation_rad, 0.0, 1e-6);
  EXPECT_GT(pose_error(found, kTruth, Symmetry::AxisZ, box_points()).rotation_rad, 3.0);
}

}  // namespace
}  // namespace grapnel
