// Every refiner of the registry, over every way to find partners.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "base/config.h"
#include "base/math.h"
#include "pipeline/kernels/target.h"
#include "pipeline/refine/closest_in_cells.h"
#include "pipeline/refine/closest_in_view.h"
#include "pipeline/refine/fitness.h"
#include "pipeline/refine/generalized_icp.h"
#include "pipeline/refine/icp.h"
#include "pipeline/registry.h"
#include "tests/pipeline/support/box_scene.h"
#include "tests/pipeline/support/surfaces.h"
#include "tests/support/heap_guard.h"

namespace grapnel {
namespace {

Pose small_motion() {
  Pose pose = Pose::Identity();
  pose.linear() = rotation_from_vector(Vec3d(0.03, -0.04, 0.05));
  pose.translation() = Vec3d(0.006, -0.004, 0.005);
  return pose;
}

std::int32_t brute_force(const Surface& surface, const Vec3f& p, float max_m) {
  std::int32_t best = -1;
  float best_square = max_m * max_m;
  for (std::size_t i = 0; i < surface.size; ++i) {
    const Vec3f gap = surface.point(i) - p;
    const float square = gap.x() * gap.x() + gap.y() * gap.y() + gap.z() * gap.z();
    if (square < best_square || (square == best_square && best < 0)) {
      best_square = square;
      best = static_cast<std::int32_t>(i);
    }
  }
  return best;
}

TEST(ClosestInCells, FindsWhatBruteForceFinds) {
  test::OwnedSurface cloud = test::random_cloud(3000, 0.5, 21);
  ClosestInCells cells;
  const test::ArenaMemory memory([&](Arena& arena) { cells.reserve(arena, 3000); });
  for (const double typical_m : {0.001, 0.03, 1.0}) {
    ASSERT_TRUE(cells.build(*cloud, typical_m).ok());
    Rng rng(22);
    for (int i = 0; i < 500; ++i) {
      const Vec3f p = Vec3d(rng.uniform(-0.1, 0.6), rng.uniform(-0.1, 0.6), rng.uniform(-0.1, 0.6))
                          .cast<float>();
      const auto reach = static_cast<float>(rng.uniform(0.005, 0.2));
      ASSERT_EQ(cells.closest(p, reach), brute_force(*cloud, p, reach));
    }
  }
}

TEST(ClosestInCells, RefusesWhatItCannotIndex) {
  test::OwnedSurface cloud = test::random_cloud(100, 0.5, 23);
  ClosestInCells cells;
  const test::ArenaMemory memory([&](Arena& arena) { cells.reserve(arena, 50); });
  EXPECT_EQ(cells.build(*cloud, 0.01).error().code, Code::CapacityExceeded);
  cloud->size = 0;
  EXPECT_EQ(cells.build(*cloud, 0.01).error().code, Code::TooFewPoints);
  cloud->size = 1;
  cloud->x[0] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(cells.build(*cloud, 0.01).error().code, Code::BadParameter);
}

TEST(ClosestInView, FindsAPointWhereItProjects) {
  test::OwnedSurface view = test::wavy_grid(60, 50, 24);
  ClosestInView closest;
  ASSERT_TRUE(closest.build(*view, 1).ok());
  for (std::size_t i = 0; i < view->size; ++i) {
    EXPECT_EQ(closest.closest(view->point(i), 0.01F), static_cast<std::int32_t>(i));
  }
  EXPECT_EQ(closest.closest(Vec3f(0.0F, 0.0F, -1.0F), 0.01F), -1);
  EXPECT_EQ(closest.closest(Vec3f(9.0F, 0.0F, 1.0F), 10.0F), -1);
  test::OwnedSurface cloud = test::random_cloud(10, 1.0, 25);
  EXPECT_FALSE(closest.build(*cloud, 1).ok());
}

TEST(Fitness, IsThatOfAKnownShift) {
  test::OwnedSurface fixed = test::random_cloud(500, 1.0, 26);
  ClosestInCells cells;
  const test::ArenaMemory memory([&](Arena& arena) { cells.reserve(arena, 500); });
  ASSERT_TRUE(cells.build(*fixed, 0.01).ok());
  // Half of the points are moved by 1 mm, the rest far away.
  test::OwnedSurface moving = test::random_cloud(500, 1.0, 26);
  for (std::size_t i = 0; i < 500; ++i) moving->x[i] += i < 250 ? 0.001F : 50.0F;
  const Fitness found = fitness(*moving, *fixed, cells, Pose::Identity(), 0.0011F);
  EXPECT_EQ(found.inliers, 250U);
  EXPECT_DOUBLE_EQ(found.inlier_ratio, 0.5);
  EXPECT_NEAR(found.rmse_m, 0.001, 1e-6);
  // PCL compares the squared distance with the limit: 0.0011² here.
  EXPECT_NEAR(pcl_fitness_score(*moving, *fixed, cells, Pose::Identity(), 0.0011 * 0.0011), 1e-6,
              2e-9);
  EXPECT_TRUE(std::isinf(
      pcl_fitness_score(*moving, *fixed, cells, Pose(Eigen::Translation3d(0.0, 99.0, 0.0)), 1e-6)));
}

class EveryRefiner : public testing::TestWithParam<std::size_t> {
 protected:
  EveryRefiner()
      : fixed_(test::surface_of(test::box_cloud(Vec3d(0.4, 0.3, 0.2), 0.01))),
        moving_(test::surface_of(test::box_cloud(Vec3d(0.4, 0.3, 0.2), 0.013))),
        memory_([&](Arena& arena) { cells_.reserve(arena, fixed_->size); }) {
    fixed_->spacing_m = moving_->spacing_m = 0.01;
    const ConfigTable empty("", "refine", 0);
    ConfigReader reader(empty);
    refiner_ = pose_refiners()[GetParam()].make(reader);
  }
  test::OwnedSurface fixed_;
  test::OwnedSurface moving_;
  ClosestInCells cells_;
  test::ArenaMemory memory_;
  std::unique_ptr<PoseRefiner> refiner_;
};

TEST_P(EveryRefiner, BringsABoxBackAlmost) {
  ASSERT_TRUE(cells_.build(*fixed_, 0.01).ok());
  const Result<RefinedPose> found = refiner_->refine(*moving_, *fixed_, cells_, small_motion());
  ASSERT_TRUE(found.ok());
  // Within half of the spacing, which point to point can't undercut.
  EXPECT_LT(found.value().target_from_source.translation().norm(), 0.005);
  EXPECT_LT(rotation_angle_rad(found.value().target_from_source, Pose::Identity()), 0.02);
}

TEST_P(EveryRefiner, SaysWhenItLostItsPartners) {
  ASSERT_TRUE(cells_.build(*fixed_, 0.01).ok());
  const Pose away(Eigen::Translation3d(5.0, 0.0, 0.0));
  const Result<RefinedPose> found = refiner_->refine(*moving_, *fixed_, cells_, away);
  ASSERT_FALSE(found.ok());
  EXPECT_EQ(found.error().code, Code::RefinementDiverged);
  EXPECT_EQ(found.error().stage, Stage::Refine);
}

TEST_P(EveryRefiner, EndsDegenerateCloudsInAnErrorOrAFinitePose) {
  for (int shape = 0; shape < 6; ++shape) {
    SCOPED_TRACE(shape);
    test::OwnedSurface moving = test::random_cloud(200, 0.3, 27);
    test::OwnedSurface fixed = test::random_cloud(200, 0.3, 28);
    for (Surface* surface : {&*moving, &*fixed}) {
      surface->spacing_m = 0.02;
      for (std::size_t i = 0; i < 200; ++i) {
        surface->nz[i] = 1.0F;
        if (shape == 1) surface->x[i] = surface->y[i] = surface->z[i];
        if (shape == 2) surface->z[i] = 0.5F;
        if (shape == 3) surface->x[i] = surface->y[i] = surface->z[i] = 0.5F;
      }
    }
    if (shape == 4) moving->x[7] = std::numeric_limits<float>::quiet_NaN();
    if (shape == 5) moving->size = 0;
    if (shape == 0) moving->size = 1;
    ASSERT_TRUE(cells_.build(*fixed, 0.01).ok());
    const Result<RefinedPose> found = refiner_->refine(*moving, *fixed, cells_, Pose::Identity());
    if (found.ok()) {
      EXPECT_TRUE(found.value().target_from_source.matrix().allFinite());
    } else {
      EXPECT_EQ(found.error().stage, Stage::Refine);
    }
  }
}

TEST_P(EveryRefiner, TakesNothingFromTheHeap) {
  if (!test::heap_guard_works()) GTEST_SKIP() << test::kNoHeapGuard;
  ASSERT_TRUE(cells_.build(*fixed_, 0.01).ok());
  test::arm_heap_guard();
  (void)refiner_->refine(*moving_, *fixed_, cells_, small_motion());
  test::disarm_heap_guard();
  EXPECT_EQ(test::heap_calls(), 0U);
}

INSTANTIATE_TEST_SUITE_P(OfTheRegistry, EveryRefiner,
                         testing::Range<std::size_t>(0, pose_refiners().size()),
                         [](const auto& refiner) {
                           return std::string(pose_refiners()[refiner.param].name);
                         });

/// A painted plane whose shape fixes neither a slide nor a turn about its normal.
test::OwnedSurface painted_plane() {
  test::OwnedSurface plane(41 * 41, 0);
  for (int i = 0; i < 41 * 41; ++i) {
    const std::size_t at = plane->size++;
    const double x = 0.01 * (i % 41 - 20);
    const double y = 0.01 * (i / 41 - 20);
    plane->x[at] = static_cast<float>(x);
    plane->y[at] = static_cast<float>(y);
    plane->z[at] = 1.0F;
    plane->nz[at] = -1.0F;
    plane->intensity[at] = static_cast<float>(0.5 + 0.25 * math::sin(25.0 * x + 11.0 * y) +
                                              0.25 * math::sin(31.0 * y - 7.0 * x));
  }
  plane->spacing_m = 0.01;
  return plane;
}

TEST(GeneralizedIcp, FixesByIntensityWhatAPlaneLeavesFree) {
  test::OwnedSurface fixed = painted_plane();
  test::OwnedSurface moving = painted_plane();
  ClosestInCells cells;
  Pose start = Pose::Identity();
  start.translation() = Vec3d(0.022, -0.018, 0.0);
  for (const bool by_intensity : {false, true}) {
    GeneralizedIcpParams params;
    params.max_iterations = 60;
    params.intensity_m = by_intensity ? 0.3 : 0.0;
    GeneralizedIcp refiner(params);
    const test::ArenaMemory memory([&](Arena& arena) {
      refiner.reserve(arena, test::small_limits());
      cells.reserve(arena, fixed->size);
    });
    ASSERT_TRUE(cells.build(*fixed, 0.01).ok());
    test::arm_heap_guard();
    const Result<RefinedPose> found = refiner.refine(*moving, *fixed, cells, start);
    test::disarm_heap_guard();
    EXPECT_EQ(test::heap_calls(), 0U);
    ASSERT_TRUE(found.ok());
    const double off_m = found.value().target_from_source.translation().norm();
    // By place alone it ends on the nearest points of the lattice, two of its steps off.
    if (by_intensity) {
      EXPECT_LT(off_m, 0.001);
    } else {
      EXPECT_GT(off_m, 0.02);
    }
  }
}

TEST(Icp, HasTheSameBitsOnEveryTarget) {
  test::OwnedSurface fixed = test::surface_of(test::box_cloud(Vec3d(0.4, 0.3, 0.2), 0.01));
  test::OwnedSurface moving = test::surface_of(test::box_cloud(Vec3d(0.4, 0.3, 0.2), 0.013));
  fixed->spacing_m = 0.01;
  ClosestInCells cells;
  const test::ArenaMemory memory([&](Arena& arena) { cells.reserve(arena, fixed->size); });
  ASSERT_TRUE(cells.build(*fixed, 0.01).ok());
  for (const IcpParams::Metric metric :
       {IcpParams::Metric::PointToPlane, IcpParams::Metric::PointToPoint,
        IcpParams::Metric::Symmetric}) {
    IcpParams params;
    params.metric = metric;
    params.max_iterations = 60;
    std::vector<Pose> poses;
    for (const std::string& target : kernels::target_names()) {
      ASSERT_TRUE(kernels::force_target(target));
      const Result<RefinedPose> found = Icp(params).refine(*moving, *fixed, cells, small_motion());
      ASSERT_TRUE(found.ok());
      poses.push_back(found.value().target_from_source);
    }
    ASSERT_TRUE(kernels::force_target(""));
    for (const Pose& pose : poses) EXPECT_EQ(pose.matrix(), poses.front().matrix());
  }
}

}  // namespace
}  // namespace grapnel
