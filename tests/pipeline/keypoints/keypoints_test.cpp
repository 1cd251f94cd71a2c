#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "pipeline/keypoints/iss.h"
#include "pipeline/keypoints/strongest.h"
#include "pipeline/keypoints/uniform.h"
#include "pipeline/preprocess/normals.h"
#include "tests/pipeline/support/surfaces.h"
#include "tests/support/heap_guard.h"

namespace grapnel {
namespace {

struct Detection {
  std::unique_ptr<KeypointDetector> detector;
  KeypointSet keypoints;
  test::ArenaMemory memory;
  Detection(std::unique_ptr<KeypointDetector> made, std::size_t capacity)
      : detector(std::move(made)), memory([&](Arena& arena) {
          detector->reserve(arena, test::small_limits());
          keypoints = KeypointSet(arena.take<Keypoint>(capacity));
        }) {}
  std::vector<std::int32_t> points() const {
    std::vector<std::int32_t> list;
    for (const Keypoint& keypoint : keypoints) list.push_back(keypoint.point);
    return list;
  }
};

struct Method {
  std::string name;
  std::function<std::unique_ptr<KeypointDetector>()> make;
};

UniformParams uniform_without_normals() {
  UniformParams params;
  params.need_normal = false;
  return params;
}

class Detector : public testing::TestWithParam<Method> {
 protected:
  Detection make(std::size_t capacity) const { return {GetParam().make(), capacity}; }
};

INSTANTIATE_TEST_SUITE_P(
    Every, Detector,
    testing::Values(Method{"iss", [] { return std::make_unique<IssDetector>(IssParams{}); }},
                    Method{"uniform",
                           [] {
                             return std::make_unique<UniformDetector>(uniform_without_normals());
                           }}),
    [](const auto& method) { return method.param.name; });

TEST_P(Detector, GivesTheSameTwiceAndOthersInBetweenDoNotMatter) {
  test::OwnedSurface ball = test::bumpy_ball(1500, 0.2);
  test::OwnedSurface grid = test::wavy_grid(60, 50, 1);
  Detection d = make(1000);
  ASSERT_TRUE(d.detector->detect(*ball, d.keypoints).ok());
  const std::vector<std::int32_t> first = d.points();
  EXPECT_GT(first.size(), 4U);
  EXPECT_TRUE(std::is_sorted(first.begin(), first.end()));
  ASSERT_TRUE(d.detector->detect(*grid, d.keypoints).ok());
  ASSERT_TRUE(d.detector->detect(*ball, d.keypoints).ok());
  EXPECT_EQ(d.points(), first);
  EXPECT_FALSE(d.keypoints.overflowed());
}

TEST_P(Detector, StaysWithinTheCapacityAndSaysSo) {
  test::OwnedSurface ball = test::bumpy_ball(1500, 0.2);
  Detection d = make(3);
  ASSERT_TRUE(d.detector->detect(*ball, d.keypoints).ok());
  EXPECT_LE(d.keypoints.size(), 3U);
  EXPECT_GE(d.keypoints.size(), 1U);
  EXPECT_TRUE(d.keypoints.overflowed());
}

TEST_P(Detector, RefusesAnEmptySurfaceAndTakesASinglePoint) {
  Detection d = make(10);
  test::OwnedSurface empty(4, 0);
  empty->spacing_m = 0.01;
  const Status status = d.detector->detect(*empty, d.keypoints);
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().code, Code::TooFewPoints);
  EXPECT_EQ(status.error().stage, Stage::Keypoints);
  test::OwnedSurface one = test::random_cloud(1, 1.0, 2);
  one->spacing_m = 0.01;
  EXPECT_TRUE(d.detector->detect(*one, d.keypoints).ok());
  EXPECT_LE(d.keypoints.size(), 1U);
  test::OwnedSurface same(50, 0);
  same->size = 50;
  same->spacing_m = 0.01;
  EXPECT_TRUE(d.detector->detect(*same, d.keypoints).ok());
}

TEST_P(Detector, DoesNotTouchTheHeap) {
  if (!test::heap_guard_works()) GTEST_SKIP() << test::kNoHeapGuard;
  test::OwnedSurface ball = test::bumpy_ball(1500, 0.2);
  Detection d = make(100);
  test::arm_heap_guard();
  const bool ok = d.detector->detect(*ball, d.keypoints).ok();
  test::disarm_heap_guard();
  EXPECT_TRUE(ok);
  EXPECT_EQ(test::heap_calls(), 0U) << test::first_heap_call();
}

TEST(IssDetector, KeypointsMoveWithTheSurface) {
  test::OwnedSurface ball = test::bumpy_ball(1500, 0.2);
  test::OwnedSurface moved = test::bumpy_ball(1500, 0.2);
  Pose pose = Pose::Identity();
  pose.linear() = Eigen::AngleAxisd(2.0, Vec3d(0.3, -0.5, 0.8).normalized()).toRotationMatrix();
  pose.translation() = Vec3d(0.5, 0.1, -0.4);
  test::move(*moved, pose);
  Detection d(std::make_unique<IssDetector>(IssParams{}), 1000);
  ASSERT_TRUE(d.detector->detect(*ball, d.keypoints).ok());
  const std::vector<std::int32_t> still = d.points();
  ASSERT_TRUE(d.detector->detect(*moved, d.keypoints).ok());
  const std::vector<std::int32_t> turned = d.points();
  std::vector<std::int32_t> common;
  std::set_intersection(still.begin(), still.end(), turned.begin(), turned.end(),
                        std::back_inserter(common));
  // A neighbour on a sphere's rim may fall to either side by rounding; hardly any does.
  EXPECT_GE(common.size() * 10, still.size() * 9);
  EXPECT_GE(common.size() * 10, turned.size() * 9);
}

TEST(IssDetector, FindsNothingOnAPlane) {
  test::OwnedSurface plane(900, 0);
  for (std::size_t i = 0; i < 900; ++i) {
    plane->x[i] = 0.01F * static_cast<float>(i % 30);
    plane->y[i] = 0.01F * static_cast<float>(i / 30);
    plane->z[i] = 1.0F;
  }
  plane->size = 900;
  plane->spacing_m = 0.01;
  Detection d(std::make_unique<IssDetector>(IssParams{}), 1000);
  ASSERT_TRUE(d.detector->detect(*plane, d.keypoints).ok());
  EXPECT_TRUE(d.keypoints.empty());
}

TEST(IssDetector, KeepsTheStrongestWhenTheyDoNotFit) {
  test::OwnedSurface ball = test::bumpy_ball(1500, 0.2);
  Detection all(std::make_unique<IssDetector>(IssParams{}), 1000);
  Detection few(std::make_unique<IssDetector>(IssParams{}), 3);
  ASSERT_TRUE(all.detector->detect(*ball, all.keypoints).ok());
  ASSERT_TRUE(few.detector->detect(*ball, few.keypoints).ok());
  std::vector<float> scores;
  for (const Keypoint& keypoint : all.keypoints) scores.push_back(keypoint.score);
  std::sort(scores.rbegin(), scores.rend());
  ASSERT_GT(scores.size(), 3U);
  for (const Keypoint& keypoint : few.keypoints) EXPECT_GE(keypoint.score, scores[2]);
}

TEST(UniformDetector, TakesOnePointACellNearestItsCentre) {
  test::OwnedSurface line(100, 0);
  for (std::size_t i = 0; i < 100; ++i) {
    line->x[i] = 0.01F * static_cast<float>(i) + 0.001F;
    line->y[i] = 0.05F;
    line->z[i] = 0.05F;
  }
  line->size = 100;
  UniformParams params = uniform_without_normals();
  params.cell_m = 0.1;
  Detection d(std::make_unique<UniformDetector>(params), 100);
  ASSERT_TRUE(d.detector->detect(*line, d.keypoints).ok());
  // Cell centres at 0.05, 0.15, …; the nearest points at 0.051, 0.151, …
  EXPECT_EQ(d.points(), (std::vector<std::int32_t>{5, 15, 25, 35, 45, 55, 65, 75, 85, 95}));
}

TEST(UniformDetector, SkipsPointsWithoutNormal) {
  test::OwnedSurface ball = test::sphere(500, 0.1, true);
  for (std::size_t i = 0; i < 250; ++i) ball->nx[i] = ball->ny[i] = ball->nz[i] = 0.0F;
  Detection d(std::make_unique<UniformDetector>(UniformParams{}), 500);
  ASSERT_TRUE(d.detector->detect(*ball, d.keypoints).ok());
  EXPECT_GT(d.keypoints.size(), 5U);
  for (const Keypoint& keypoint : d.keypoints) EXPECT_GE(keypoint.point, 250);
}

TEST(KeepStrongest, BreaksTiesByTheLowerPoint) {
  std::vector<Keypoint> candidates = {
      {7, 1.0F, 0.0F}, {3, 1.0F, 0.0F}, {5, 2.0F, 0.0F}, {1, 1.0F, 0.0F}};
  std::vector<Keypoint> memory(2);
  KeypointSet set{std::span<Keypoint>(memory)};
  keep_strongest(candidates, set);
  ASSERT_EQ(set.size(), 2U);
  EXPECT_EQ(set[0].point, 1);
  EXPECT_EQ(set[1].point, 5);
  EXPECT_TRUE(set.overflowed());
}

}  // namespace
}  // namespace grapnel
