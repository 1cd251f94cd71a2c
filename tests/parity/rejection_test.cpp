// PCL's own expected numbers for matching and rejection: test_registration_api.cpp pairs each point
// of bun0 with the nearest of bun4. Here the matcher does that, with coordinates for descriptors.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <memory>
#include <vector>

#include "base/cloud_file.h"
#include "pipeline/correspond/nearest_feature.h"
#include "pipeline/kernels/rigid_pairs.h"
#include "pipeline/reject/distance.h"
#include "pipeline/reject/median.h"
#include "pipeline/reject/one_to_one.h"
#include "pipeline/reject/ransac.h"
#include "pipeline/reject/trimmed.h"
#include "tests/parity/pcl_correspondences.h"
#include "tests/pipeline/support/surfaces.h"
#include "tests/support/recorded_data.h"

namespace grapnel {
namespace {

class PclPairs : public testing::Test {
 protected:
  void SetUp() override {
    const std::filesystem::path bun0 = test::recorded_data("pcl_test/bun0.pcd");
    const std::filesystem::path bun4 = test::recorded_data("pcl_test/bun4.pcd");
    if (bun0.empty() || bun4.empty()) GTEST_SKIP() << test::kNoRecordedData;
    source_ = std::make_unique<test::OwnedSurface>(test::surface_of(read_cloud(bun0)));
    target_ = std::make_unique<test::OwnedSurface>(test::surface_of(read_cloud(bun4)));
    ASSERT_EQ((*source_)->size, 397U);
    ASSERT_EQ((*target_)->size, 361U);
    match(false);
  }

  void match(bool mutual) {
    NearestFeatureParams params;
    params.metric = Metric::L2Squared;
    params.mutual = mutual;
    NearestFeature matcher(params);
    FeatureMatrix source;
    FeatureMatrix target;
    const test::ArenaMemory memory([&](Arena& arena) {
      matcher.reserve(arena, Limits{});
      source.reserve(arena, 397, 3);
      target.reserve(arena, 361, 3);
    });
    const auto coordinates = [](const Surface& surface, FeatureMatrix& rows) {
      rows.rows = surface.size;
      for (std::size_t i = 0; i < surface.size; ++i) {
        const Vec3f p = surface.point(i);
        std::copy_n(p.data(), 3, rows.row(i).begin());
      }
    };
    coordinates(**source_, source);
    coordinates(**target_, target);
    ASSERT_TRUE(matcher.match(source, target, pairs_).ok());
  }

  template <class Rejector>
  std::vector<std::int32_t> kept_by(Rejector rejector) {
    const test::ArenaMemory memory([&](Arena& arena) { rejector.reserve(arena, Limits{}); });
    std::vector<Keypoint> keypoints;
    for (std::int32_t i = 0; i < 397; ++i) keypoints.push_back({i, 1.0F, 0.0F});
    Rng rng(1);
    EXPECT_TRUE(rejector.reject({&**source_, &**target_, keypoints, keypoints}, pairs_, rng).ok());
    return sources();
  }
  [[nodiscard]] std::vector<std::int32_t> sources() const {
    std::vector<std::int32_t> list;
    for (const Correspondence& pair : pairs_) list.push_back(pair.source);
    return list;
  }
  template <std::size_t kCount>
  static std::vector<std::int32_t> listed(const std::array<std::int32_t, kCount>& numbers) {
    return {numbers.begin(), numbers.end()};
  }

  std::unique_ptr<test::OwnedSurface> source_, target_;
  std::vector<Correspondence> storage_ = std::vector<Correspondence>(397);
  Correspondences pairs_{storage_};
};

// CorrespondenceEstimation: 397 pairs.
TEST_F(PclPairs, AreTheNearestPoints) {
  ASSERT_EQ(pairs_.size(), 397U);
  for (std::size_t i = 0; i < 397; ++i) {
    EXPECT_EQ(pairs_[i].source, static_cast<std::int32_t>(i));
    EXPECT_EQ(pairs_[i].target, pcl_numbers::kNearest[i]);
  }
}

// CorrespondenceEstimationReciprocal: 53 pairs.
TEST_F(PclPairs, AreFiftyThreeWhenBothSidesMustChoose) {
  match(true);
  EXPECT_EQ(sources(), listed(pcl_numbers::kReciprocal));
}

// CorrespondenceRejectorDistance, 0.01 m: 97 pairs. The pairs hold squared distances.
TEST_F(PclPairs, WithinADistanceAreNinetySeven) {
  EXPECT_EQ(kept_by(DistanceRejector({0.01 * 0.01})), listed(pcl_numbers::kWithinDistance));
}

// CorrespondenceRejectorMedianDistance, factor 0.5: 139 pairs, median 0.000465391.
TEST_F(PclPairs, WithinHalfTheMedianAreAHundredAndThirtyNine) {
  std::vector<float> distances;
  for (const Correspondence& pair : pairs_) distances.push_back(pair.distance);
  std::nth_element(distances.begin(), distances.begin() + 198, distances.end());
  EXPECT_NEAR(distances[198], 0.000465391, 1e-9);
  EXPECT_EQ(kept_by(MedianRejector({0.5})), listed(pcl_numbers::kWithinHalfMedian));
}

// CorrespondenceRejectorOneToOne: 103 pairs (listed there by target).
TEST_F(PclPairs, OneToOneAreAHundredAndThree) {
  EXPECT_EQ(kept_by(OneToOneRejector({})), listed(pcl_numbers::kOneToOne));
}

// CorrespondenceRejectorTrimmed, overlap 0.5: 198 pairs (listed there by distance).
TEST_F(PclPairs, TrimmedToHalfAreAHundredAndNinetyEight) {
  EXPECT_EQ(kept_by(TrimmedRejector({0.5, 0})), listed(pcl_numbers::kTrimmed));
}

// CorrespondenceRejectorSampleConsensus, 0.01 m: its motion has the 97 inliers listed.
TEST_F(PclPairs, OfPclsMotionAreItsInliers) {
  std::vector<std::int32_t> inliers;
  for (const Correspondence& pair : pairs_) {
    const Vec3f s = (*source_)->point(static_cast<std::size_t>(pair.source));
    const Vec3f t = (*target_)->point(static_cast<std::size_t>(pair.target));
    Vec3f off;
    for (std::size_t i = 0; i < 3; ++i) {
      const auto& row = pcl_numbers::kSampleConsensusMotion[i];
      off[static_cast<Eigen::Index>(i)] = row[0] * s.x() + row[1] * s.y() + row[2] * s.z() +
                                          row[3] - t[static_cast<Eigen::Index>(i)];
    }
    if (off.norm() <= 0.01F) inliers.push_back(pair.source);
  }
  EXPECT_EQ(inliers, listed(pcl_numbers::kSampleConsensus));
}

// The same test: which pairs PCL ends with depends on its random numbers; no fewer may be found.
TEST_F(PclPairs, OfTheBestMotionAreAtLeastNinetySeven) {
  RansacRejectorParams params;
  params.draws = 1000;
  params.inlier_distance_m = 0.01;
  EXPECT_GE(kept_by(RansacRejector(params)).size(), 97U);
}

}  // namespace
}  // namespace grapnel
