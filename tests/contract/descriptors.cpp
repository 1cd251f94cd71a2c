// What every descriptor of the registry must do, whoever wrote it.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstring>
#include <numeric>
#include <string>
#include <vector>

#include "base/rng.h"
#include "pipeline/kernels/target.h"
#include "tests/contract/feature_contract.h"
#include "tests/support/heap_guard.h"

namespace grapnel {
namespace {

using test::MethodCase;

/// Rows of the described keypoints, one after the other.
using Rows = std::vector<float>;

class DescriptorContract : public testing::TestWithParam<MethodCase> {
 protected:
  /// The method with nothing thinned, so that the order of points does not choose among them.
  [[nodiscard]] static MethodCase unthinned(MethodCase chosen) {
    if (test::has_key(descriptor_estimators(), chosen, "max_neighbours")) {
      chosen.keys += "max_neighbours = 500\n";
    }
    return chosen;
  }
  [[nodiscard]] static Result<Rows> describe(const MethodCase& chosen, const Surface& surface,
                                             const std::vector<Keypoint>& keypoints,
                                             std::size_t max_rows = 200) {
    const auto estimator = test::make_stage(descriptor_estimators(), chosen);
    FeatureMatrix features;
    const test::ArenaMemory memory([&](Arena& arena) {
      estimator->reserve(arena, test::contract_limits());
      features.reserve(arena, max_rows, estimator->dimension());
    });
    const Status status = estimator->describe(surface, keypoints, features);
    if (!status.ok()) return status.error();
    EXPECT_EQ(features.rows, keypoints.size());
    Rows rows;
    for (std::size_t i = 0; i < features.rows; ++i) {
      rows.insert(rows.end(), features.row(i).begin(), features.row(i).end());
    }
    return rows;
  }
  /// Sum of differences as a share of the sum of values.
  [[nodiscard]] static double difference(const Rows& a, const Rows& b) {
    EXPECT_EQ(a.size(), b.size());
    double off = 0.0;
    double all = 0.0;
    for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i) {
      off += std::fabs(static_cast<double>(a[i]) - static_cast<double>(b[i]));
      all += std::fabs(static_cast<double>(a[i]));
    }
    EXPECT_GT(all, 0.0);
    return off / all;
  }
};

INSTANTIATE_TEST_SUITE_P(Registry, DescriptorContract,
                         testing::ValuesIn(test::every_choice(descriptor_estimators(), "engine")),
                         [](const auto& given) { return test::case_name(given.param); });

TEST_P(DescriptorContract, DoesNotChangeWhenTheSurfaceMoves) {
  test::OwnedSurface ball = test::oriented_ball(900);
  const std::vector<Keypoint> keypoints = test::keypoints_of(*ball, 20);
  const Result<Rows> still = describe(unthinned(GetParam()), *ball, keypoints);
  Pose pose = Pose::Identity();
  pose.linear() = rotation_from_vector(Vec3d(-0.3, 0.9, 0.5));
  pose.translation() = Vec3d(0.2, -0.5, 0.3);
  test::move(*ball, pose);
  const Result<Rows> moved = describe(unthinned(GetParam()), *ball, keypoints);
  ASSERT_TRUE(still.ok() && moved.ok());
  // Rounding moves pairs over borders of bins and neighbours over the sphere's rim.
  EXPECT_LT(difference(still.value(), moved.value()), 0.005);
}

TEST_P(DescriptorContract, DoesNotDependOnTheOrderOfThePoints) {
  test::OwnedSurface ball = test::oriented_ball(900);
  std::vector<std::size_t> order(ball->size);
  std::iota(order.begin(), order.end(), 0U);
  Rng rng(8);
  for (std::size_t i = order.size(); i > 1; --i) {
    std::swap(order[i - 1], order[rng.below(static_cast<std::uint32_t>(i))]);
  }
  test::OwnedSurface shuffled = test::oriented_ball(900);
  std::vector<Keypoint> keypoints;
  std::vector<Keypoint> same_places;
  for (std::size_t i = 0; i < order.size(); ++i) {
    const std::array<std::span<float> Surface::*, 6> planes = {
        &Surface::x, &Surface::y, &Surface::z, &Surface::nx, &Surface::ny, &Surface::nz};
    for (const auto plane : planes) ((*shuffled).*plane)[i] = ((*ball).*plane)[order[i]];
    if (i % 20 != 0) continue;
    keypoints.push_back({static_cast<std::int32_t>(order[i]), 1.0F, 0.0F});
    same_places.push_back({static_cast<std::int32_t>(i), 1.0F, 0.0F});
  }
  const Result<Rows> a = describe(unthinned(GetParam()), *ball, keypoints);
  const Result<Rows> b = describe(unthinned(GetParam()), *shuffled, same_places);
  ASSERT_TRUE(a.ok() && b.ok());
  // Sums in another order, and pairs whose two ends are equally good for the source.
  EXPECT_LT(difference(a.value(), b.value()), 0.002);
}

TEST_P(DescriptorContract, DoesNotChangeWithTheScaleOfPointsAndRadii) {
  test::OwnedSurface ball = test::oriented_ball(900);
  const std::vector<Keypoint> keypoints = test::keypoints_of(*ball, 20);
  const Result<Rows> small = describe(unthinned(GetParam()), *ball, keypoints);
  for (std::size_t i = 0; i < ball->size; ++i) {
    ball->x[i] *= 8.0F;
    ball->y[i] *= 8.0F;
    ball->z[i] *= 8.0F;
  }
  ball->spacing_m *= 8.0;
  const Result<Rows> large = describe(unthinned(GetParam()), *ball, keypoints);
  ASSERT_TRUE(small.ok() && large.ok());
  // A power of two changes no digit of a float, but the radius is rounded on its own.
  EXPECT_LT(difference(small.value(), large.value()), 0.002);
}

TEST_P(DescriptorContract, GivesTheSameBitsOnEveryTarget) {
  test::OwnedSurface ball = test::oriented_ball(900);
  const std::vector<Keypoint> keypoints = test::keypoints_of(*ball, 20);
  Rows first;
  for (const std::string& target : kernels::target_names()) {
    ASSERT_TRUE(kernels::force_target(target));
    const Result<Rows> rows = describe(GetParam(), *ball, keypoints);
    ASSERT_TRUE(kernels::force_target(""));
    ASSERT_TRUE(rows.ok());
    if (first.empty()) first = rows.value();
    ASSERT_EQ(first.size(), rows.value().size());
    EXPECT_EQ(std::memcmp(first.data(), rows.value().data(), first.size() * sizeof(float)), 0)
        << target;
  }
}

TEST_P(DescriptorContract, AgreesWithItsReferenceEngine) {
  MethodCase reference = unthinned(GetParam());
  const std::size_t at = reference.keys.find("\"fast\"");
  if (at == std::string::npos) GTEST_SKIP() << "no fast engine";
  reference.keys.replace(at, 6, "\"reference\"");
  test::OwnedSurface ball = test::oriented_ball(900);
  const std::vector<Keypoint> keypoints = test::keypoints_of(*ball, 20);
  const Result<Rows> fast = describe(unthinned(GetParam()), *ball, keypoints);
  const Result<Rows> plain = describe(reference, *ball, keypoints);
  ASSERT_TRUE(fast.ok() && plain.ok());
  // Single against double precision: a few pairs in ten thousand change their bin.
  EXPECT_LT(difference(plain.value(), fast.value()), 0.001);
}

TEST_P(DescriptorContract, GivesAnErrorOrFiniteRowsOnOddSurfacesInBoundedTime) {
  for (test::OddSurface& odd : test::odd_surfaces()) {
    const std::vector<Keypoint> keypoints = test::keypoints_of(*odd.surface, 3);
    const auto start = std::chrono::steady_clock::now();
    const Result<Rows> rows = describe(GetParam(), *odd.surface, keypoints);
    const auto took = std::chrono::steady_clock::now() - start;
    // A hundred points take a millisecond in the slowest engine; a loop without end takes longer.
    EXPECT_LT(took, std::chrono::seconds(2)) << odd.name;
    if (!rows.ok()) {
      EXPECT_EQ(rows.error().stage, Stage::Descriptors) << odd.name;
      continue;
    }
    EXPECT_TRUE(odd.name.find("NaN") == std::string::npos) << odd.name;
    for (const float value : rows.value()) ASSERT_TRUE(std::isfinite(value)) << odd.name;
  }
}

TEST_P(DescriptorContract, RefusesMoreThanFits) {
  test::OwnedSurface ball = test::oriented_ball(900);
  const std::vector<Keypoint> keypoints = test::keypoints_of(*ball, 20);
  const Result<Rows> too_many = describe(GetParam(), *ball, keypoints, 10);
  ASSERT_FALSE(too_many.ok());
  EXPECT_EQ(too_many.error().code, Code::CapacityExceeded);
  test::OwnedSurface large = test::bumpy_ball(3000, 0.2);
  const Result<Rows> too_large = describe(GetParam(), *large, keypoints);
  ASSERT_FALSE(too_large.ok());
  EXPECT_EQ(too_large.error().code, Code::CapacityExceeded);
}

TEST_P(DescriptorContract, GivesZerosWhereAKeypointHasNoNormal) {
  test::OwnedSurface ball = test::oriented_ball(900);
  ball->nx[0] = ball->ny[0] = ball->nz[0] = 0.0F;
  const Result<Rows> rows = describe(GetParam(), *ball, {{0, 1.0F, 0.0F}, {450, 1.0F, 0.0F}});
  ASSERT_TRUE(rows.ok());
  const auto middle = rows.value().begin() + static_cast<std::ptrdiff_t>(rows.value().size() / 2);
  EXPECT_TRUE(std::all_of(rows.value().begin(), middle, [](float v) { return v == 0.0F; }));
  EXPECT_FALSE(std::all_of(middle, rows.value().end(), [](float v) { return v == 0.0F; }));
}

TEST_P(DescriptorContract, DescribesAPointGivenTwiceTwice) {
  test::OwnedSurface ball = test::oriented_ball(900);
  const Result<Rows> rows = describe(GetParam(), *ball, {{450, 1.0F, 0.0F}, {450, 2.0F, 0.1F}});
  ASSERT_TRUE(rows.ok());
  const std::size_t half = rows.value().size() / 2;
  EXPECT_TRUE(std::equal(rows.value().begin(),
                         rows.value().begin() + static_cast<std::ptrdiff_t>(half),
                         rows.value().begin() + static_cast<std::ptrdiff_t>(half)));
}

TEST_P(DescriptorContract, DoesNotTouchTheHeap) {
  if (!test::heap_guard_works()) GTEST_SKIP() << test::kNoHeapGuard;
  test::OwnedSurface ball = test::oriented_ball(900);
  const std::vector<Keypoint> keypoints = test::keypoints_of(*ball, 20);
  const auto estimator = test::make_stage(descriptor_estimators(), GetParam());
  FeatureMatrix features;
  const test::ArenaMemory memory([&](Arena& arena) {
    estimator->reserve(arena, test::contract_limits());
    features.reserve(arena, 200, estimator->dimension());
  });
  EXPECT_EQ(memory.measured_bytes(), memory.used_bytes());
  test::arm_heap_guard();
  const bool ok = estimator->describe(*ball, keypoints, features).ok();
  test::disarm_heap_guard();
  EXPECT_TRUE(ok);
  EXPECT_EQ(test::heap_calls(), 0U) << test::first_heap_call();
}

}  // namespace
}  // namespace grapnel
