#include "pipeline/size_estimator.h"

#include <gtest/gtest.h>

#include "tests/pipeline/support/shapes.h"

namespace grapnel {
namespace {

using test::OwnedSurface;
using Shape = SizeEstimate::Shape;

/// The part stands on its lower side; the camera looks down on it at 40 degrees, turned by `yaw`.
Pose standing(double yaw_rad) {
  Pose pose = Pose::Identity();
  pose.linear() =
      rotation_from_vector(Vec3d(2.27, 0.0, 0.0)) * rotation_from_vector(Vec3d(0.0, 0.0, yaw_rad));
  pose.translation() = Vec3d(0.05, -0.02, 1.2);
  return pose;
}

Ground ground_below(const Pose& camera_from_part, double half_height_m) {
  Ground ground;
  ground.normal = camera_from_part.linear().col(2);
  ground.offset_m = -ground.normal.dot(camera_from_part * Vec3d(0.0, 0.0, -half_height_m));
  return ground;
}

SizeEstimate estimate(Surface& view, const Ground& ground) {
  SizeEstimator estimator;
  const test::ArenaMemory memory([&](Arena& arena) { estimator.reserve(arena, 20000); });
  return estimator.estimate(view, ground, Rng(3));
}

// Ends are known to a spacing.
constexpr double kEnd_m = test::kShapeSpacing_m;

TEST(SizeEstimator, MeasuresABoxOnTheGround) {
  OwnedSurface box = test::box_surface({0.42, 0.31, 0.23});
  for (const double yaw_rad : {0.5, 1.2, 2.6}) {
    OwnedSurface view = test::seen(*box, standing(yaw_rad), 0.002);
    const SizeEstimate size = estimate(*view, ground_below(standing(yaw_rad), 0.115));
    ASSERT_EQ(size.shape, Shape::Box);
    EXPECT_NEAR(size.size_m.x(), 0.42, kEnd_m);
    EXPECT_NEAR(size.size_m.y(), 0.31, kEnd_m);
    EXPECT_NEAR(size.size_m.z(), 0.23, 0.004);
    EXPECT_GT(size.sigma_m, 0.0);
  }
}

TEST(SizeEstimator, MeasuresABoxOfWhichOnlyTheTopIsSeen) {
  OwnedSurface box = test::box_surface({0.42, 0.31, 0.23});
  Pose pose = Pose::Identity();
  pose.linear() = rotation_from_vector(Vec3d(3.14159265, 0.0, 0.0)) *
                  rotation_from_vector(Vec3d(0.0, 0.0, 0.6));
  pose.translation() = Vec3d(0.0, 0.0, 1.2);
  OwnedSurface view = test::seen(*box, pose, 0.002);
  const SizeEstimate on_ground = estimate(*view, ground_below(pose, 0.115));
  ASSERT_EQ(on_ground.shape, Shape::Box);
  EXPECT_NEAR(on_ground.size_m.x(), 0.42, kEnd_m);
  EXPECT_NEAR(on_ground.size_m.y(), 0.31, kEnd_m);
  EXPECT_NEAR(on_ground.size_m.z(), 0.23, 0.004);
  // Nobody can say how high it is where nobody knows what it stands on.
  EXPECT_EQ(estimate(*view, Ground{}).size_m.z(), 0.0);
}

TEST(SizeEstimator, MeasuresABarrelsDiameterAndLength) {
  OwnedSurface barrel = test::barrel_surface(0.15, 0.36);
  OwnedSurface view = test::seen(*barrel, standing(0.3), 0.002);
  const SizeEstimate size = estimate(*view, ground_below(standing(0.3), 0.18));
  ASSERT_EQ(size.shape, Shape::Barrel);
  EXPECT_NEAR(size.size_m.x(), 0.30, 0.004);
  EXPECT_EQ(size.size_m.x(), size.size_m.y());
  EXPECT_NEAR(size.size_m.z(), 0.36, kEnd_m);
}

TEST(SizeEstimator, CallsABallNeither) {
  OwnedSurface ball = test::sphere(3000, 0.15, true);
  OwnedSurface view = test::seen(*ball, standing(0.0), 0.002);
  EXPECT_EQ(estimate(*view, ground_below(standing(0.0), 0.15)).shape, Shape::None);
}

TEST(SizeEstimator, SaysNothingOfAnEmptyOrDegenerateSurface) {
  OwnedSurface box = test::box_surface({0.1, 0.1, 0.1});
  OwnedSurface view = test::seen(*box, standing(0.0), 0.0);
  for (std::size_t i = 0; i < view->size; ++i) view->x[i] = view->y[i] = view->z[i] = 1.0F;
  const SizeEstimate point = estimate(*view, Ground{});
  EXPECT_TRUE(point.size_m.allFinite());
  view->size = 0;
  EXPECT_EQ(estimate(*view, Ground{}).shape, Shape::None);
}

}  // namespace
}  // namespace grapnel
