#include <gtest/gtest.h>

#include <algorithm>
#include <optional>
#include <vector>

#include "pipeline/reject/distance.h"
#include "pipeline/reject/graph.h"
#include "pipeline/reject/median.h"
#include "pipeline/reject/one_to_one.h"
#include "pipeline/reject/ransac.h"
#include "pipeline/reject/surface_normal.h"
#include "pipeline/reject/trimmed.h"
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
  const test::ArenaMemory memory([&](Arena& arena) { rejector.reserve(arena, Limits{}); });
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

/// Two clouds that are one moved, and pairs between them: a third right, the rest shuffled.
class Agreement : public testing::Test {
 protected:
  static constexpr std::int32_t kPoints = 240;

  Agreement() {
    truth_.linear() = rotation_from_vector(Vec3d(0.5, 1.0, -0.3));
    // Far from the origin, where single precision alone would not do.
    truth_.translation() = Vec3d(100.0, -200.0, 300.0);
    for (const Surface* surface : {&*source_, &*target_}) {
      Rng rng(6);
      for (std::size_t i = 0; i < surface->size; ++i) {
        const Vec3d n = Vec3d(rng.normal(), rng.normal(), rng.normal()).normalized();
        surface->nx[i] = static_cast<float>(n.x());
        surface->ny[i] = static_cast<float>(n.y());
        surface->nz[i] = static_cast<float>(n.z());
      }
    }
    test::move(*target_, truth_);
    target_->spacing_m = 0.01;
    for (std::int32_t i = 0; i < kPoints; ++i) {
      keypoints_.push_back({i, 1.0F, 0.0F});
      const bool right = i % 3 == 0;
      pairs_.push_back({i, right ? i : (i * 7 + 13) % kPoints, right ? 1.0F : 2.0F});
    }
  }
  [[nodiscard]] PairView view() { return {&*source_, &*target_, keypoints_, keypoints_}; }
  template <class Rejector>
  Status run(Rejector& rejector) {
    memory_.emplace([&](Arena& arena) { rejector.reserve(arena, Limits{}); });
    Rng rng(1);
    return rejector.reject(view(), pairs_, rng);
  }
  [[nodiscard]] std::size_t right() const {
    std::size_t count = 0;
    for (const Correspondence& pair : pairs_) count += pair.source == pair.target ? 1U : 0U;
    return count;
  }
  [[nodiscard]] bool in_order() const {
    for (std::size_t k = 1; k < pairs_.size(); ++k) {
      if (pairs_[k].source <= pairs_[k - 1].source) return false;
    }
    return true;
  }

  test::OwnedSurface source_ = test::random_cloud(kPoints, 1.0, 3);
  test::OwnedSurface target_ = test::random_cloud(kPoints, 1.0, 3);
  Pose truth_ = Pose::Identity();
  std::vector<Keypoint> keypoints_;
  std::vector<Correspondence> storage_ = std::vector<Correspondence>(kPoints);
  Correspondences pairs_{storage_};
  std::optional<test::ArenaMemory> memory_;  ///< of the rejector that ran last
};

TEST_F(Agreement, RansacKeepsAllRightPairsFarFromTheOrigin) {
  RansacRejector rejector({});
  ASSERT_TRUE(run(rejector).ok());
  EXPECT_EQ(right(), 80U);
  EXPECT_LE(pairs_.size(), 82U);
  EXPECT_TRUE(in_order());
}

TEST_F(Agreement, RansacStopsEarlyWhenAskedForAConfidence) {
  RansacRejectorParams params;
  params.draws = 100000;
  RansacRejector all(params);
  ASSERT_TRUE(run(all).ok());
  params.confidence = 0.99;
  pairs_.resize(kPoints);
  for (std::int32_t i = 0; i < kPoints; ++i) {
    pairs_[static_cast<std::size_t>(i)] = {i, i % 3 == 0 ? i : (i * 7 + 13) % kPoints, 1.0F};
  }
  RansacRejector some(params);
  ASSERT_TRUE(run(some).ok());
  EXPECT_EQ(right(), 80U);
  EXPECT_LT(some.rated() * 10, all.rated());
}

TEST_F(Agreement, GraphCliquesKeepTheRightPairsAlone) {
  GraphRejector rejector({});
  ASSERT_TRUE(run(rejector).ok());
  EXPECT_EQ(right(), 80U);
  EXPECT_LE(pairs_.size(), 92U);
  EXPECT_TRUE(in_order());
}

TEST_F(Agreement, GraphCoreKeepsTheRightPairs) {
  GraphRejectorParams params;
  params.keep = GraphKeep::Core;
  GraphRejector rejector(params);
  ASSERT_TRUE(run(rejector).ok());
  EXPECT_EQ(right(), 80U);
  EXPECT_LE(pairs_.size(), 82U);
}

TEST_F(Agreement, GraphKeepsBothMotionsOfASymmetricPart) {
  // The second half of the right pairs belongs to another motion: two cliques of 40.
  Pose turned = truth_;
  turned.linear() = truth_.linear() * rotation_from_vector(Vec3d(0.0, 0.0, 3.0));
  for (std::int32_t i = 120; i < kPoints; i += 3) {
    const auto at = static_cast<std::size_t>(i);
    const Vec3f p = (turned * source_->point(at).cast<double>()).cast<float>();
    const Vec3f n = (turned.linear() * source_->normal(at).cast<double>()).cast<float>();
    target_->x[at] = p.x();
    target_->y[at] = p.y();
    target_->z[at] = p.z();
    target_->nx[at] = n.x();
    target_->ny[at] = n.y();
    target_->nz[at] = n.z();
  }
  GraphRejector rejector({});
  ASSERT_TRUE(run(rejector).ok());
  EXPECT_EQ(right(), 80U);
  std::vector<std::size_t> sizes(rejector.clique_sizes().begin(), rejector.clique_sizes().end());
  std::sort(sizes.rbegin(), sizes.rend());
  ASSERT_GE(sizes.size(), 2U);
  EXPECT_GE(sizes[0], 40U);
  EXPECT_GE(sizes[1], 40U);
}

TEST_F(Agreement, GraphKeepsTheNearestWhenThereAreTooMany) {
  GraphRejectorParams params;
  params.max_pairs = 100;
  GraphRejector rejector(params);
  ASSERT_TRUE(run(rejector).ok());
  EXPECT_EQ(right(), 80U);
}

TEST_F(Agreement, GraphSaysWhenNothingAgrees) {
  std::size_t kept = 0;
  for (const Correspondence pair : pairs_) {
    if (pair.source % 3 != 0 && pair.source < 30) pairs_[kept++] = pair;
  }
  pairs_.resize(kept);
  target_->spacing_m = 1e-6;
  GraphRejector rejector({});
  const Status status = run(rejector);
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().code, Code::NoConsensus);
}

TEST_F(Agreement, DistanceDropsPairsAsFarOrFarther) {
  DistanceRejector rejector({2.0});
  ASSERT_TRUE(run(rejector).ok());
  EXPECT_EQ(pairs_.size(), 80U);
  EXPECT_EQ(right(), 80U);
}

TEST_F(Agreement, TrimmedKeepsTheNearestShareInOrder) {
  TrimmedRejector rejector({0.25, 0});
  ASSERT_TRUE(run(rejector).ok());
  EXPECT_EQ(pairs_.size(), 60U);
  EXPECT_EQ(right(), 60U);
  EXPECT_TRUE(in_order());
  TrimmedRejector at_least({0.25, 50});
  ASSERT_TRUE(run(at_least).ok());
  EXPECT_EQ(pairs_.size(), 50U);
}

TEST_F(Agreement, OneToOneKeepsTheNearestSourceOfEachTarget) {
  OneToOneRejector rejector({});
  ASSERT_TRUE(run(rejector).ok());
  EXPECT_EQ(right(), 80U);
  std::vector<std::size_t> uses(kPoints, 0);
  for (const Correspondence& pair : pairs_) ++uses[static_cast<std::size_t>(pair.target)];
  EXPECT_EQ(*std::max_element(uses.begin(), uses.end()), 1U);
  EXPECT_TRUE(in_order());
}

TEST_F(Agreement, SurfaceNormalKeepsPairsWhoseNormalsPointTheSameWay) {
  // Back in the source's frame, the right pairs' normals are equal.
  test::move(*target_, truth_.inverse());
  target_->nx[0] = target_->ny[0] = target_->nz[0] = 0.0F;
  SurfaceNormalRejector rejector({0.99});
  ASSERT_TRUE(run(rejector).ok());
  EXPECT_EQ(right(), 79U);
  EXPECT_LE(pairs_.size(), 85U);
}

}  // namespace
}  // namespace grapnel
