// What a registration of two views must be, whatever it is made of: the way back is the inverse,
// motions, scale and the order of points do not matter, degenerate views end in a named error.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <optional>

#include "pipeline/registrar.h"
#include "tests/contract/feature_contract.h"
#include "tests/contract/hills.h"

namespace grapnel {
namespace {

/// A quarter of the distance between the sheet's points: ICP lies this near to the truth.
constexpr double kTolerance_m = 0.004;
constexpr double kTolerance_rad = 0.015;

/// By the shipped preset for pairs.
class PairProperties : public testing::Test {
 protected:
  PairProperties() {
    const std::filesystem::path config = std::filesystem::path(GRAPNEL_SOURCE_DIR) / "config";
    Preset preset = load_preset(config / "presets" / "02-pair.toml", config / "models");
    preset.limits.max_points = preset.limits.max_input_points = 4000;
    preset.limits.max_model_points = 4000;
    registrar_ = Registrar::create(std::move(preset));
  }
  std::optional<Pose> pose_of(const Surface& source, const Surface& target) {
    const auto answer = registrar_->register_pair(source, target, {});
    EXPECT_TRUE(answer.ok());
    if (!answer.ok() || answer.value().objects.empty()) return std::nullopt;
    EXPECT_TRUE(answer.value().objects[0].accepted);
    return answer.value().objects[0].target_from_source;
  }
  static void expect_near(const Pose& found, const Pose& expected) {
    // About the sheet's middle, which lies at the source's origin.
    EXPECT_LT((found.translation() - expected.translation()).norm(), kTolerance_m);
    EXPECT_LT(rotation_angle_rad(found, expected), kTolerance_rad);
  }

  Pose truth_ = test::truth_of_pair();
  test::OwnedSurface source_ = test::sheet(50, 0.0, Pose::Identity());
  test::OwnedSurface target_ = test::sheet(52, 0.3, truth_);
  std::unique_ptr<Registrar> registrar_;
};

TEST_F(PairProperties, TheWayBackIsTheInverse) {
  const std::optional<Pose> there = pose_of(*source_, *target_);
  const std::optional<Pose> back = pose_of(*target_, *source_);
  ASSERT_TRUE(there && back);
  expect_near(*there, truth_);
  expect_near(*back * *there, Pose::Identity());
}

TEST_F(PairProperties, MotionsOfTheViewsMoveTheAnswer) {
  Pose of_source = Pose::Identity();
  of_source.linear() = rotation_from_vector(Vec3d(0.4, 0.9, -0.5));
  of_source.translation() = Vec3d(0.2, -0.3, 0.6);
  Pose of_target = Pose::Identity();
  of_target.linear() = rotation_from_vector(Vec3d(-1.2, 0.3, 0.8));
  of_target.translation() = Vec3d(-0.5, 0.1, 0.3);
  test::move(*source_, of_source);
  test::move(*target_, of_target);
  const std::optional<Pose> found = pose_of(*source_, *target_);
  ASSERT_TRUE(found);
  expect_near(of_target.inverse() * *found * of_source, truth_);
}

TEST_F(PairProperties, TheOrderOfThePointsDoesNotMatter) {
  for (Surface* surface : {&*source_, &*target_}) {
    const auto n = static_cast<std::ptrdiff_t>(surface->size);
    for (std::span<float> Surface::*plane : {&Surface::x, &Surface::y, &Surface::z, &Surface::nx,
                                             &Surface::ny, &Surface::nz, &Surface::intensity}) {
      std::reverse((surface->*plane).begin(), (surface->*plane).begin() + n);
    }
  }
  const std::optional<Pose> found = pose_of(*source_, *target_);
  ASSERT_TRUE(found);
  expect_near(*found, truth_);
}

TEST_F(PairProperties, TheUnitOfLengthDoesNotMatter) {
  constexpr double kScale = 2.0;
  for (Surface* surface : {&*source_, &*target_}) {
    for (std::size_t i = 0; i < surface->size; ++i) {
      surface->x[i] *= static_cast<float>(kScale);
      surface->y[i] *= static_cast<float>(kScale);
      surface->z[i] *= static_cast<float>(kScale);
    }
    surface->viewpoint *= static_cast<float>(kScale);
    surface->spacing_m *= kScale;
  }
  std::optional<Pose> found = pose_of(*source_, *target_);
  ASSERT_TRUE(found);
  found->translation() /= kScale;
  expect_near(*found, truth_);
}

TEST_F(PairProperties, DegenerateViewsEndInANamedErrorOrARejectionInBoundedTime) {
  for (test::OddSurface& odd : test::odd_surfaces()) {
    for (const bool as_source : {true, false}) {
      SCOPED_TRACE(odd.name + (as_source ? " onto a sheet" : " under a sheet"));
      const auto start = std::chrono::steady_clock::now();
      const auto answer = as_source ? registrar_->register_pair(*odd.surface, *target_, {})
                                    : registrar_->register_pair(*source_, *odd.surface, {});
      EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(5));
      if (!answer.ok()) {
        EXPECT_NE(answer.error().code, Code::Ok);
        EXPECT_NE(answer.error().code, Code::InternalFault);
        EXPECT_NE(answer.error().stage, Stage::None);
        continue;
      }
      EXPECT_NE(answer.value().code, Code::ObjectFound);
      for (const RegistrationReport& report : answer.value().objects) {
        EXPECT_FALSE(report.accepted);
        EXPECT_FALSE(report.reasons.empty());
      }
    }
  }
}

TEST_F(PairProperties, ViewsThatDoNotFitAreRefusedByName) {
  test::OwnedSurface large = test::sheet(90, 0.0, Pose::Identity());
  ASSERT_GT(large->size, 4000U);
  for (const bool as_source : {true, false}) {
    const auto answer = as_source ? registrar_->register_pair(*large, *target_, {})
                                  : registrar_->register_pair(*source_, *large, {});
    ASSERT_FALSE(answer.ok());
    EXPECT_EQ(answer.error().code, Code::CapacityExceeded);
  }
}

}  // namespace
}  // namespace grapnel
