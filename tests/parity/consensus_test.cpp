// PCL's own numbers for poses without a guess, test_sac_ia.cpp: bun0, moved 100 m and turned by a
// quarter, onto bun4, by FPFH of every point.
#include <gtest/gtest.h>

#include <memory>
#include <vector>

#include "base/cloud_file.h"
#include "pipeline/coarse/generators.h"
#include "pipeline/coarse/triples.h"
#include "pipeline/correspond/nearest_feature.h"
#include "pipeline/descriptors/fpfh.h"
#include "pipeline/preprocess/normals.h"
#include "pipeline/refine/closest_in_cells.h"
#include "pipeline/refine/fitness.h"
#include "tests/pipeline/support/surfaces.h"
#include "tests/support/recorded_data.h"

namespace grapnel {
namespace {

class PclConsensus : public testing::Test {
 protected:
  void SetUp() override {
    const std::filesystem::path bun0 = test::recorded_data("pcl_test/bun0.pcd");
    if (bun0.empty()) GTEST_SKIP() << test::kNoRecordedData;
    source_ = std::make_unique<test::OwnedSurface>(test::surface_of(read_cloud(bun0)));
    target_ = std::make_unique<test::OwnedSurface>(
        test::surface_of(read_cloud(test::recorded_data("pcl_test/bun4.pcd"))));
    Pose offset = Pose::Identity();
    offset.linear() = rotation_from_vector(Vec3d(0.0, 0.0, 1.5707963267948966));
    offset.translation() = Vec3d(100.0, 0.0, 0.0);
    test::move(**source_, offset);
  }

  /// FPFH within 0.05 m of every point, and each source point's `top` nearest.
  void match(double normal_radius_m, std::size_t top) {
    Limits limits = test::small_limits();
    limits.descriptor_dimension = FpfhEstimator::kDimension;
    limits.max_correspondences = 4000;
    PcaNormalsParams normal_params;
    normal_params.radius_m = normal_radius_m;
    PcaNormals normals(normal_params);
    FpfhParams fpfh_params;
    fpfh_params.radius_m = 0.05;
    FpfhEstimator fpfh(fpfh_params);
    NearestFeatureParams match_params;
    match_params.top = top;
    NearestFeature matcher(match_params);
    FeatureMatrix rows[2];
    const test::ArenaMemory memory([&](Arena& arena) {
      normals.reserve(arena, limits);
      fpfh.reserve(arena, limits);
      matcher.reserve(arena, limits);
      for (FeatureMatrix& matrix : rows) matrix.reserve(arena, 400, FpfhEstimator::kDimension);
    });
    Surface* const surfaces[2] = {&**source_, &**target_};
    for (std::size_t side = 0; side < 2; ++side) {
      surfaces[side]->spacing_m = 0.005;
      ASSERT_TRUE(normals.estimate(*surfaces[side]).ok());
      keypoints_[side].clear();
      for (std::int32_t i = 0; i < static_cast<std::int32_t>(surfaces[side]->size); ++i) {
        keypoints_[side].push_back({i, 1.0F, 0.0F});
      }
      ASSERT_TRUE(fpfh.describe(*surfaces[side], keypoints_[side], rows[side]).ok());
    }
    ASSERT_TRUE(matcher.match(rows[0], rows[1], pairs_).ok());
  }
  [[nodiscard]] PairView view() { return {&**source_, &**target_, keypoints_[0], keypoints_[1]}; }
  template <class Generator>
  Pose best(Generator& generator) {
    const test::ArenaMemory memory(
        [&](Arena& arena) { generator.reserve(arena, test::small_limits()); });
    std::vector<Hypothesis> storage(4);
    Hypotheses hypotheses{std::span<Hypothesis>(storage)};
    Rng rng(1);
    EXPECT_TRUE(generator.generate(view(), pairs_, rng, hypotheses).ok());
    return hypotheses.empty() ? Pose::Identity() : hypotheses[0].target_from_source;
  }

  std::unique_ptr<test::OwnedSurface> source_, target_;
  std::vector<Keypoint> keypoints_[2];
  std::vector<Correspondence> storage_ = std::vector<Correspondence>(4000);
  Correspondences pairs_{storage_};
};

TEST_F(PclConsensus, SampleConsensusInitialAlignmentEndsBelowTheListedFitness) {
  match(0.05, 10);
  SampleConsensusParams params;
  params.draws = 1000;
  params.max_distance_m = 0.1;
  params.rated_points = 0;
  params.min_extent_share = 0.05 / extent_m(**source_, keypoints_[0]);
  SampleConsensus consensus(params);
  const Pose pose = best(consensus);
  ClosestInCells cells;
  const test::ArenaMemory memory([&](Arena& arena) { cells.reserve(arena, 400); });
  ASSERT_TRUE(cells.build(**target_, 0.02).ok());
  EXPECT_LT(pcl_fitness_score(**source_, **target_, cells, pose, 100.0), 0.0005);
}

TEST_F(PclConsensus, PrerejectedTriplesBringMoreThanTheListedShareTogether) {
  // The listed radius of 0.005 m holds no three points of most: PCL counts what NaN leaves.
  match(0.05, 2);
  RansacGeneratorParams params;
  params.draws = 5000;
  params.min_edge_ratio = 0.6;
  params.inlier_m = 0.01;
  RansacGenerator ransac(params);
  const Pose pose = best(ransac);
  ClosestInCells cells;
  const test::ArenaMemory memory([&](Arena& arena) { cells.reserve(arena, 400); });
  ASSERT_TRUE(cells.build(**target_, 0.02).ok());
  EXPECT_GT(fitness(**source_, **target_, cells, pose, 0.1F).inlier_ratio, 0.95);
  // The bound alone is mild for a bunny of 0.15 m: the pose's mean distance must be small as well.
  EXPECT_LT(pcl_fitness_score(**source_, **target_, cells, pose, 100.0), 0.0005);
}

}  // namespace
}  // namespace grapnel
