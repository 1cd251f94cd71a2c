#include "pipeline/descriptors/fpfh.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numeric>
#include <vector>

#include "base/rng.h"
#include "pipeline/descriptors/pair_feature.h"
#include "pipeline/kernels/target.h"
#include "pipeline/preprocess/normals.h"
#include "tests/pipeline/support/surfaces.h"
#include "tests/support/heap_guard.h"

namespace grapnel {
namespace {

struct Described {
  FpfhEstimator fpfh;
  FeatureMatrix features;
  test::ArenaMemory memory;
  explicit Described(const FpfhParams& params = {}, std::size_t rows = 300)
      : fpfh(params), memory([&](Arena& arena) {
          fpfh.reserve(arena, test::small_limits());
          features.reserve(arena, rows, FpfhEstimator::kDimension);
        }) {}
  std::vector<float> values(std::size_t rows) const {
    std::vector<float> list;
    for (std::size_t i = 0; i < rows; ++i) {
      list.insert(list.end(), features.row(i).begin(), features.row(i).end());
    }
    return list;
  }
};

void add_normals(Surface& surface) {
  PcaNormals normals({});
  const test::ArenaMemory memory(
      [&](Arena& arena) { normals.reserve(arena, test::small_limits()); });
  ASSERT_TRUE(normals.estimate(surface).ok());
}

test::OwnedSurface ball_with_normals() {
  test::OwnedSurface ball = test::bumpy_ball(1200, 0.2);
  add_normals(*ball);
  return ball;
}

std::vector<Keypoint> every(std::size_t step, std::size_t size) {
  std::vector<Keypoint> keypoints;
  for (std::size_t i = 0; i < size; i += step) {
    keypoints.push_back({static_cast<std::int32_t>(i), 1.0F, 0.0F});
  }
  return keypoints;
}

TEST(Fpfh, EveryThirdSumsToAHundred) {
  test::OwnedSurface ball = ball_with_normals();
  const std::vector<Keypoint> keypoints = every(10, ball->size);
  Described d;
  ASSERT_TRUE(d.fpfh.describe(*ball, keypoints, d.features).ok());
  ASSERT_EQ(d.features.rows, keypoints.size());
  for (std::size_t row = 0; row < d.features.rows; ++row) {
    for (std::size_t third = 0; third < 3; ++third) {
      const std::span<const float> bins = d.features.row(row).subspan(11 * third, 11);
      ASSERT_NEAR(std::accumulate(bins.begin(), bins.end(), 0.0), 100.0, 1e-3);
    }
  }
}

TEST(Fpfh, FastEngineAgreesWithTheReference) {
  test::OwnedSurface ball = ball_with_normals();
  const std::vector<Keypoint> keypoints = every(10, ball->size);
  FpfhParams reference;
  reference.engine = Engine::Reference;
  Described fast;
  Described plain(reference);
  ASSERT_TRUE(fast.fpfh.describe(*ball, keypoints, fast.features).ok());
  ASSERT_TRUE(plain.fpfh.describe(*ball, keypoints, plain.features).ok());
  const std::vector<float> a = fast.values(keypoints.size());
  const std::vector<float> b = plain.values(keypoints.size());
  double difference = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) difference += std::fabs(a[i] - b[i]);
  // A pair on a bin's border may change sides: of 300 per row, less than 0.1.
  EXPECT_LT(difference / static_cast<double>(keypoints.size()), 0.1);
}

TEST(Fpfh, GivesTheSameBitsOnEveryTarget) {
  test::OwnedSurface ball = ball_with_normals();
  const std::vector<Keypoint> keypoints = every(10, ball->size);
  std::vector<float> first;
  for (const std::string& target : kernels::target_names()) {
    ASSERT_TRUE(kernels::force_target(target));
    Described d;
    ASSERT_TRUE(d.fpfh.describe(*ball, keypoints, d.features).ok());
    const std::vector<float> values = d.values(keypoints.size());
    if (first.empty()) first = values;
    EXPECT_EQ(std::memcmp(first.data(), values.data(), first.size() * sizeof(float)), 0) << target;
  }
  ASSERT_TRUE(kernels::force_target(""));
}

TEST(Fpfh, OfPointsTogetherHasTheBitsOfEachAlone) {
  test::OwnedSurface ball = ball_with_normals();
  const std::vector<Keypoint> keypoints = every(7, ball->size);
  Described together;
  ASSERT_TRUE(together.fpfh.describe(*ball, keypoints, together.features).ok());
  // One point without a normal, far behind the others: each must look which of its own have one.
  test::OwnedSurface more(ball->size + 1, 0);
  more->size = ball->size + 1;
  more->spacing_m = ball->spacing_m;
  for (std::size_t i = 0; i <= ball->size; ++i) {
    const std::size_t from = std::min(i, ball->size - 1);
    more->x[i] = ball->x[from];
    more->y[i] = ball->y[from];
    more->z[i] = ball->z[from];
    if (i == ball->size) continue;
    more->nx[i] = ball->nx[from];
    more->ny[i] = ball->ny[from];
    more->nz[i] = ball->nz[from];
  }
  more->x[ball->size] = 0.5F;
  more->y[ball->size] = 0.5F;
  more->z[ball->size] = 0.5F;
  Described alone;
  ASSERT_TRUE(alone.fpfh.describe(*more, keypoints, alone.features).ok());
  EXPECT_EQ(together.values(keypoints.size()), alone.values(keypoints.size()));
}

TEST(Fpfh, DoesNotChangeWhenTheSurfaceMoves) {
  test::OwnedSurface ball = ball_with_normals();
  const std::vector<Keypoint> keypoints = every(10, ball->size);
  Described still;
  ASSERT_TRUE(still.fpfh.describe(*ball, keypoints, still.features).ok());
  Pose pose = Pose::Identity();
  pose.linear() = Eigen::AngleAxisd(0.9, Vec3d(-0.2, 0.5, 0.8).normalized()).toRotationMatrix();
  pose.translation() = Vec3d(0.2, -0.5, 0.3);
  test::move(*ball, pose);
  Described moved;
  ASSERT_TRUE(moved.fpfh.describe(*ball, keypoints, moved.features).ok());
  const std::vector<float> a = still.values(keypoints.size());
  const std::vector<float> b = moved.values(keypoints.size());
  double difference = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) difference += std::fabs(a[i] - b[i]);
  // Rounding moves pairs over bins' borders and neighbours over the sphere's rim: under 0.5 % of a
  // row's sum of 300.
  EXPECT_LT(difference / static_cast<double>(keypoints.size()), 1.5);
}

TEST(Fpfh, GivesZerosWhereThereIsNoNormalOrNoNeighbour) {
  test::OwnedSurface ball = ball_with_normals();
  ball->nx[0] = ball->ny[0] = ball->nz[0] = 0.0F;
  ball->x[10] += 5.0F;
  const std::vector<Keypoint> keypoints = every(10, 30);
  Described d;
  ASSERT_TRUE(d.fpfh.describe(*ball, keypoints, d.features).ok());
  for (const float value : d.features.row(0)) EXPECT_EQ(value, 0.0F);
  for (const float value : d.features.row(1)) EXPECT_EQ(value, 0.0F);
  EXPECT_GT(d.features.row(2)[5], 0.0F);
}

TEST(Fpfh, RefusesMoreKeypointsThanRowsAndAnEmptySurface) {
  test::OwnedSurface ball = ball_with_normals();
  Described d({}, 5);
  const std::vector<Keypoint> many = every(1, 100);
  EXPECT_EQ(d.fpfh.describe(*ball, many, d.features).error().code, Code::CapacityExceeded);
  test::OwnedSurface empty(4, 0);
  empty->spacing_m = 0.01;
  EXPECT_EQ(d.fpfh.describe(*empty, {}, d.features).error().code, Code::TooFewPoints);
}

TEST(Fpfh, DoesNotTouchTheHeap) {
  if (!test::heap_guard_works()) GTEST_SKIP() << test::kNoHeapGuard;
  test::OwnedSurface ball = ball_with_normals();
  const std::vector<Keypoint> keypoints = every(10, ball->size);
  Described d;
  test::arm_heap_guard();
  const bool ok = d.fpfh.describe(*ball, keypoints, d.features).ok();
  test::disarm_heap_guard();
  EXPECT_TRUE(ok);
  EXPECT_EQ(test::heap_calls(), 0U) << test::first_heap_call();
}

TEST(PairFeature, IsThatOfTheHandComputedPair) {
  // p at the origin with normal z, q one metre along x with a normal leaning 0.5 rad toward -x:
  // q's normal makes the smaller angle with the line, so that q is the source.
  const Vec3d leaning(-std::sin(0.5), 0.0, std::cos(0.5));
  const PairFeature f =
      pair_feature(Vec3d::Zero(), Vec3d(0.0, 0.0, 1.0), Vec3d(1.0, 0.0, 0.0), leaning);
  ASSERT_TRUE(f.valid);
  EXPECT_NEAR(f.distance_m, 1.0, 1e-15);
  EXPECT_NEAR(f.f3, std::sin(0.5), 1e-15);
  EXPECT_NEAR(f.f2, 0.0, 1e-15);
  EXPECT_NEAR(std::fabs(f.f1_rad), 0.5, 1e-15);
}

TEST(PairFeature, IsTheSameFromEitherEnd) {
  Rng rng(4);
  const auto random = [&] { return Vec3d(rng.normal(), rng.normal(), rng.normal()); };
  for (int i = 0; i < 500; ++i) {
    const Vec3d p = random();
    const Vec3d q = random();
    const Vec3d np = random().normalized();
    const Vec3d nq = random().normalized();
    const PairFeature a = pair_feature(p, np, q, nq);
    const PairFeature b = pair_feature(q, nq, p, np);
    ASSERT_NEAR(a.f1_rad, b.f1_rad, 1e-12);
    ASSERT_NEAR(a.f2, b.f2, 1e-12);
    ASSERT_NEAR(a.f3, b.f3, 1e-12);
  }
}

TEST(PairFeature, IsAbsentForCoincidentPointsAndAlongTheNormal) {
  const Vec3d z(0.0, 0.0, 1.0);
  EXPECT_FALSE(pair_feature(Vec3d::Zero(), z, Vec3d::Zero(), z).valid);
  EXPECT_FALSE(pair_feature(Vec3d::Zero(), z, z, Vec3d(1.0, 0.0, 0.0)).valid);
}

}  // namespace
}  // namespace grapnel
