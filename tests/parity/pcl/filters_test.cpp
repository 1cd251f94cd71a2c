// Filters and refinement beside the installed PCL, on recorded clouds.
#include <pcl/filters/radius_outlier_removal.h>
#include <pcl/filters/statistical_outlier_removal.h>
#include <pcl/filters/voxel_grid.h>
#include <pcl/registration/icp.h>

#include <gtest/gtest.h>

#include "pipeline/preprocess/radius_outliers.h"
#include "pipeline/preprocess/statistical_outliers.h"
#include "pipeline/preprocess/voxel.h"
#include "pipeline/refine/closest_in_cells.h"
#include "pipeline/refine/plain_icp.h"
#include "tests/parity/pcl/clouds.h"

namespace grapnel {
namespace {

using PclCloud = pcl::PointCloud<pcl::PointXYZ>;

template <class Filter>
std::size_t left_by(Filter&& filter, Surface& surface) {
  const Limits limits = test::limits_for(surface);
  const test::ArenaMemory memory([&](Arena& arena) { filter.reserve(arena, limits); });
  EXPECT_TRUE(filter.apply(surface).ok());
  return surface.size;
}

class PclSideBySide : public testing::TestWithParam<const char*> {};

TEST_P(PclSideBySide, StatisticalOutliersLeaveTheSamePoints) {
  for (const Engine engine : {Engine::Fast, Engine::Reference}) {
    test::OwnedSurface surface = test::recorded_surface(GetParam());
    if (surface->size == 0) return;
    pcl::StatisticalOutlierRemoval<pcl::PointXYZ> theirs;
    theirs.setInputCloud(test::pcl_points(*surface));
    theirs.setMeanK(20);
    theirs.setStddevMulThresh(1.5);
    PclCloud out;
    theirs.filter(out);
    ASSERT_EQ(left_by(StatisticalOutliers({20, 1.5, engine}), *surface), out.size());
    for (std::size_t i = 0; i < out.size(); ++i) ASSERT_EQ(surface->x[i], out[i].x) << i;
  }
}

TEST_P(PclSideBySide, RadiusOutliersLeaveTheSamePoints) {
  test::OwnedSurface surface = test::recorded_surface(GetParam());
  if (surface->size == 0) return;
  pcl::RadiusOutlierRemoval<pcl::PointXYZ> theirs;
  theirs.setInputCloud(test::pcl_points(*surface));
  theirs.setRadiusSearch(0.013);
  theirs.setMinNeighborsInRadius(7);
  PclCloud out;
  theirs.filter(out);
  RadiusOutlierParams params;
  params.radius_m = 0.013;
  params.min_neighbours = 7;
  EXPECT_EQ(left_by(RadiusOutliers(params), *surface), out.size());
}

TEST_P(PclSideBySide, VoxelsHaveTheSameCentroidsInTheSameOrder) {
  test::OwnedSurface surface = test::recorded_surface(GetParam());
  if (surface->size == 0) return;
  pcl::VoxelGrid<pcl::PointXYZ> theirs;
  theirs.setInputCloud(test::pcl_points(*surface));
  theirs.setLeafSize(0.011F, 0.011F, 0.011F);
  PclCloud out;
  theirs.filter(out);
  ASSERT_EQ(left_by(VoxelGrid({0.011, 6000}), *surface), out.size());
  for (std::size_t i = 0; i < out.size(); ++i) {
    // PCL sums in single precision.
    ASSERT_NEAR(surface->x[i], out[i].x, 2e-6F) << i;
    ASSERT_NEAR(surface->y[i], out[i].y, 2e-6F) << i;
    ASSERT_NEAR(surface->z[i], out[i].z, 2e-6F) << i;
  }
}

INSTANTIATE_TEST_SUITE_P(Recorded, PclSideBySide,
                         testing::Values("pcl_test/bun0.pcd", "pcl_test/bun4.pcd"),
                         [](const auto& cloud) { return std::string(cloud.param).substr(9, 4); });

TEST(PclRefinement, IterativeClosestPointEndsAtTheSamePose) {
  test::OwnedSurface source = test::recorded_surface("pcl_test/bun0.pcd");
  if (source->size == 0) return;
  test::OwnedSurface target = test::recorded_surface("pcl_test/bun4.pcd");
  pcl::IterativeClosestPoint<pcl::PointXYZ, pcl::PointXYZ> theirs;
  theirs.setInputSource(test::pcl_points(*source));
  theirs.setInputTarget(test::pcl_points(*target));
  theirs.setMaximumIterations(50);
  theirs.setTransformationEpsilon(1e-8);
  theirs.setMaxCorrespondenceDistance(0.05);
  PclCloud out;
  theirs.align(out);
  PlainIcpParams params;
  params.max_distance_m = 0.05;
  ClosestInCells cells;
  const test::ArenaMemory memory([&](Arena& arena) { cells.reserve(arena, target->size); });
  ASSERT_TRUE(cells.build(*target, 0.01).ok());
  const Result<RefinedPose> ours =
      PlainIcp(params).refine(*source, *target, cells, Pose::Identity());
  ASSERT_TRUE(ours.ok());
  const Eigen::Matrix4d expected = theirs.getFinalTransformation().cast<double>();
  // PCL's own tolerance of this pose: it compares the cosine of a step, in single precision, with
  // 1 - 1e-8, so that it may stop some steps sooner or later.
  EXPECT_LT((ours.value().target_from_source.matrix() - expected).cwiseAbs().maxCoeff(), 1e-3);
}

}  // namespace
}  // namespace grapnel
