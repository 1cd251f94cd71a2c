#include <gtest/gtest.h>

#include <vector>

#include "pipeline/reject/median.h"
#include "pipeline/reject/ransac.h"
#include "tests/pipeline/support/surfaces.h"

namespace grapnel {
namespace {

TEST(MedianRejector, KeepsEightOfPclsSquares) {
  // PCL, test_correspondence_rejectors.cpp: distances 0, 1, 4, …, 100, factor 2.
  std::vector<Correspondence> storage(11);
  Correspondences pairs{storage};
  for (std::int32_t i = 0; i <= 10; ++i) pairs.push_back({i, i, static_cast<float>(i * i)});
  MedianRejector rejector({2.0});
  Limits limits;
  const test::ArenaMemory memory([&](Arena& arena) { rejector.reserve(arena, limits); });
  Rng rng(1);
  ASSERT_TRUE(rejector.reject({}, pairs, rng).ok());
  ASSERT_EQ(pairs.size(), 8U);
  for (std::int32_t i = 0; i < 8; ++i) EXPECT_EQ(pairs[static_cast<std::size_t>(i)].source, i);
}

TEST(RansacRejector, KeepsThePairsOfOneMotionInTheirOrder) {
  test::OwnedSurface source = test::random_cloud(100, 1.0, 3);
  test::OwnedSurface target = test::random_cloud(100, 1.0, 3);
  target->spacing_m = 0.01;
  Pose truth = Pose::Identity();
  truth.linear() = rotation_from_vector(Vec3d(0.5, 1.0, -0.3));
  truth.translation() = Vec3d(1.0, 2.0, 3.0);
  test::move(*target, truth);
  std::vector<Keypoint> keypoints(100);
  for (std::int32_t i = 0; i < 100; ++i) keypoints[static_cast<std::size_t>(i)].point = i;
  std::vector<Correspondence> storage(100);
  Correspondences pairs{storage};
  for (std::int32_t i = 0; i < 100; ++i) {
    pairs.push_back({i, i % 3 == 0 ? i : (i * 7 + 13) % 100, 0.0F});
  }
  RansacRejector rejector({});
  Rng rng(1);
  ASSERT_TRUE(rejector.reject({&*source, &*target, keypoints, keypoints}, pairs, rng).ok());
  ASSERT_GE(pairs.size(), 34U);
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    const auto s = static_cast<std::size_t>(pairs[k].source);
    const auto t = static_cast<std::size_t>(pairs[k].target);
    const Vec3d carried = truth * source->point(s).cast<double>();
    EXPECT_LT((carried - target->point(t).cast<double>()).norm(), 0.02);
    if (k > 0) {
      EXPECT_GT(pairs[k].source, pairs[k - 1].source);
    }
  }
}

TEST(RansacRejector, SaysWhenThereIsNothingToAgreeOn) {
  std::vector<Correspondence> storage(2);
  Correspondences pairs{storage};
  RansacRejector rejector({});
  Rng rng(1);
  const Status status = rejector.reject({}, pairs, rng);
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().code, Code::TooFewCorrespondences);
}

}  // namespace
}  // namespace grapnel
