// What every refiner of the registry must be: bound to no frame, unit or order, and undone by the
// way back.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <string>

#include "base/config.h"
#include "pipeline/preprocess/normals.h"
#include "pipeline/refine/closest_in_cells.h"
#include "pipeline/registry.h"
#include "tests/pipeline/support/surfaces.h"

namespace grapnel {
namespace {

constexpr std::size_t kMost = 3000;

test::OwnedSurface ball(std::size_t points) {
  test::OwnedSurface surface = test::bumpy_ball(points, 0.2);
  PcaNormals normals({});
  const test::ArenaMemory memory(
      [&](Arena& arena) { normals.reserve(arena, test::small_limits()); });
  EXPECT_TRUE(normals.estimate(*surface).ok());
  return surface;
}

Pose pose_of(const Vec3d& turn_rad, const Vec3d& shift_m) {
  Pose pose = Pose::Identity();
  pose.linear() = rotation_from_vector(turn_rad);
  pose.translation() = shift_m;
  return pose;
}

class RefinerProperties : public testing::TestWithParam<std::size_t> {
 protected:
  RefinerProperties() : memory_([&](Arena& arena) { cells_.reserve(arena, kMost); }) {
    const ConfigTable empty("", "refine", 0);
    ConfigReader reader(empty);
    refiner_ = pose_refiners()[GetParam()].make(reader);
  }
  /// The pose found from `start`; identity, which no test expects, when none is.
  Pose refined(Surface& moving, Surface& fixed, const Pose& start) {
    EXPECT_TRUE(cells_.build(fixed, fixed.spacing_m).ok());
    const Result<RefinedPose> found = refiner_->refine(moving, fixed, cells_, start);
    EXPECT_TRUE(found.ok());
    return found.ok() ? found.value().target_from_source : Pose::Identity();
  }
  static void expect_near(const Pose& found, const Pose& expected, double tolerance_m,
                          double tolerance_rad) {
    EXPECT_LT((found.translation() - expected.translation()).norm(), tolerance_m);
    EXPECT_LT(rotation_angle_rad(found, expected), tolerance_rad);
  }

  // Rounding turns a partner or two, and an iteration more or less follows.
  static constexpr double kRounding_m = 1e-4;
  static constexpr double kRounding_rad = 5e-4;

  test::OwnedSurface fixed_ = ball(kMost);
  test::OwnedSurface moving_ = ball(1500);
  Pose start_ = pose_of(Vec3d(0.03, -0.04, 0.05), Vec3d(0.006, -0.004, 0.005));
  ClosestInCells cells_;
  test::ArenaMemory memory_;
  std::unique_ptr<PoseRefiner> refiner_;
};

TEST_P(RefinerProperties, MotionsOfBothMoveTheAnswer) {
  const Pose still = refined(*moving_, *fixed_, start_);
  const Pose of_moving = pose_of(Vec3d(0.4, -0.7, 1.1), Vec3d(0.3, 0.2, -0.5));
  const Pose of_fixed = pose_of(Vec3d(-0.9, 0.2, 0.6), Vec3d(-0.1, 0.4, 0.7));
  test::move(*moving_, of_moving);
  test::move(*fixed_, of_fixed);
  const Pose moved = refined(*moving_, *fixed_, of_fixed * start_ * of_moving.inverse());
  expect_near(of_fixed.inverse() * moved * of_moving, still, kRounding_m, kRounding_rad);
}

TEST_P(RefinerProperties, TheOrderOfThePointsDoesNotMatter) {
  const Pose straight = refined(*moving_, *fixed_, start_);
  for (Surface* surface : {&*moving_, &*fixed_}) {
    const auto n = static_cast<std::ptrdiff_t>(surface->size);
    for (std::span<float> Surface::*plane :
         {&Surface::x, &Surface::y, &Surface::z, &Surface::nx, &Surface::ny, &Surface::nz}) {
      std::reverse((surface->*plane).begin(), (surface->*plane).begin() + n);
    }
  }
  // A refiner that takes a share of the points takes others.
  expect_near(refined(*moving_, *fixed_, start_), straight, 5e-4, 2.5e-3);
}

TEST_P(RefinerProperties, TheUnitOfLengthDoesNotMatter) {
  const Pose still = refined(*moving_, *fixed_, start_);
  for (Surface* surface : {&*moving_, &*fixed_}) {
    for (std::size_t i = 0; i < surface->size; ++i) {
      surface->x[i] *= 2.0F;
      surface->y[i] *= 2.0F;
      surface->z[i] *= 2.0F;
    }
    surface->spacing_m *= 2.0;
  }
  Pose start = start_;
  start.translation() *= 2.0;
  Pose larger = refined(*moving_, *fixed_, start);
  larger.translation() /= 2.0;
  // What ends the iterations is given in metres.
  expect_near(larger, still, 3e-4, 1.5e-3);
}

TEST_P(RefinerProperties, TheWayBackIsTheInverse) {
  const Pose there = refined(*moving_, *fixed_, start_);
  const Pose back = refined(*fixed_, *moving_, start_.inverse());
  // Both within a tenth of the coarser spacing of the truth, which is the identity.
  const double tolerance_m = 0.1 * moving_->spacing_m;
  expect_near(back * there, Pose::Identity(), tolerance_m, tolerance_m / 0.2 * 2.0);
}

INSTANTIATE_TEST_SUITE_P(OfTheRegistry, RefinerProperties,
                         testing::Range<std::size_t>(0, pose_refiners().size()),
                         [](const auto& refiner) {
                           return std::string(pose_refiners()[refiner.param].name);
                         });

}  // namespace
}  // namespace grapnel
