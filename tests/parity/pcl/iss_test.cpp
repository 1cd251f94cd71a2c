// ISS against PCL's on the same clouds, at PCL's parameters.
#include <gtest/gtest.h>
#include <pcl/keypoints/iss_3d.h>
#include <pcl/search/kdtree.h>

#include <algorithm>
#include <vector>

#include "pipeline/keypoints/iss.h"
#include "tests/parity/pcl/clouds.h"
#include "tests/support/recorded_data.h"

namespace grapnel {
namespace {

std::vector<std::int32_t> pcl_iss(const Surface& surface, double salient_m, double non_max_m) {
  pcl::ISSKeypoint3D<pcl::PointXYZ, pcl::PointXYZ> detector;
  detector.setSearchMethod(
      pcl::search::KdTree<pcl::PointXYZ>::Ptr(new pcl::search::KdTree<pcl::PointXYZ>));
  detector.setSalientRadius(salient_m);
  detector.setNonMaxRadius(non_max_m);
  detector.setThreshold21(0.975);
  detector.setThreshold32(0.975);
  detector.setMinNeighbors(5);
  detector.setInputCloud(test::pcl_points(surface));
  pcl::PointCloud<pcl::PointXYZ> found;
  detector.compute(found);
  std::vector<std::int32_t> points;
  for (const int index : detector.getKeypointsIndices()->indices) points.push_back(index);
  std::sort(points.begin(), points.end());
  return points;
}

std::vector<std::int32_t> our_iss(const Surface& surface, double salient_m, double non_max_m) {
  IssParams params;
  params.salient_radius_m = salient_m;
  params.non_max_radius_m = non_max_m;
  params.normalise = false;
  IssDetector detector(params);
  KeypointSet set;
  const test::ArenaMemory memory([&](Arena& arena) {
    detector.reserve(arena, test::limits_for(surface));
    set = KeypointSet(arena.take<Keypoint>(surface.size));
  });
  EXPECT_TRUE(detector.detect(surface, set).ok());
  std::vector<std::int32_t> points;
  for (const Keypoint& keypoint : set) points.push_back(keypoint.point);
  return points;
}

TEST(IssAgainstPcl, FindsTheSameOnABumpyBall) {
  test::OwnedSurface ball = test::bumpy_ball(3000, 0.2);
  const double spacing = ball->spacing_m;
  const std::vector<std::int32_t> theirs = pcl_iss(*ball, 6.0 * spacing, 4.0 * spacing);
  EXPECT_GT(theirs.size(), 10U);
  EXPECT_EQ(our_iss(*ball, 6.0 * spacing, 4.0 * spacing), theirs);
}

TEST(IssAgainstPcl, FindsTheSameOnTheMilkCarton) {
  test::OwnedSurface milk = test::recorded_surface("pcl_test/milk.pcd");
  if (milk->size == 0) GTEST_SKIP() << test::kNoRecordedData;
  const std::vector<std::int32_t> theirs = pcl_iss(*milk, 0.01, 0.006);
  EXPECT_GT(theirs.size(), 10U);
  EXPECT_EQ(our_iss(*milk, 0.01, 0.006), theirs);
}

}  // namespace
}  // namespace grapnel
