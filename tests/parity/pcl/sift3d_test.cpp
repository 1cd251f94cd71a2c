// SIFT 3D against PCL's on the same clouds and the same intensities.
#include <gtest/gtest.h>
#include <pcl/keypoints/sift_keypoint.h>
#include <pcl/search/kdtree.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "base/cloud_file.h"
#include "pipeline/keypoints/sift3d.h"
#include "tests/parity/pcl/clouds.h"
#include "tests/support/recorded_data.h"

namespace grapnel {
namespace {

struct Place {
  Vec3f at;
  float scale_m = 0.0F;
};

std::vector<Place> our_places(const Surface& surface, const SiftParams& params) {
  SiftDetector detector(params);
  KeypointSet set;
  const test::ArenaMemory memory([&](Arena& arena) {
    detector.reserve(arena, test::limits_for(surface));
    set = KeypointSet(arena.take<Keypoint>(surface.size));
  });
  EXPECT_TRUE(detector.detect(surface, set).ok());
  std::vector<Place> places;
  for (const Keypoint& keypoint : set) {
    places.push_back({surface.point(static_cast<std::size_t>(keypoint.point)) + keypoint.offset_m,
                      keypoint.scale_m});
  }
  return places;
}

std::vector<Place> pcl_places(const Surface& surface, const SiftParams& params) {
  pcl::SIFTKeypoint<pcl::PointXYZI, pcl::PointWithScale> detector;
  detector.setSearchMethod(
      pcl::search::KdTree<pcl::PointXYZI>::Ptr(new pcl::search::KdTree<pcl::PointXYZI>));
  detector.setScales(static_cast<float>(params.min_scale_m), params.octaves,
                     params.scales_per_octave);
  detector.setMinimumContrast(static_cast<float>(params.min_contrast));
  detector.setInputCloud(test::pcl_points_with_intensity(surface));
  pcl::PointCloud<pcl::PointWithScale> found;
  detector.compute(found);
  std::vector<Place> places;
  for (const pcl::PointWithScale& point : found) {
    places.push_back({point.getVector3fMap(), point.scale});
  }
  return places;
}

std::size_t in_common(const std::vector<Place>& a, const std::vector<Place>& b) {
  return static_cast<std::size_t>(std::count_if(a.begin(), a.end(), [&](const Place& p) {
    return std::any_of(b.begin(), b.end(), [&](const Place& q) {
      return (p.at - q.at).norm() < 1e-5F && std::fabs(p.scale_m - q.scale_m) < 1e-5F;
    });
  }));
}

class SiftAgainstPcl : public testing::TestWithParam<Engine> {};
INSTANTIATE_TEST_SUITE_P(BothEngines, SiftAgainstPcl,
                         testing::Values(Engine::Fast, Engine::Reference));

TEST_P(SiftAgainstPcl, FindsTheSameBlobsOnAPaintedBall) {
  test::OwnedSurface ball = test::bumpy_ball(6000, 0.2);
  for (std::size_t i = 0; i < ball->size; ++i) {
    const Vec3f p = ball->point(i);
    ball->intensity[i] = 0.5F + 0.2F * std::sin(80.0F * p.x()) * std::sin(70.0F * p.y()) +
                         0.2F * std::sin(90.0F * p.z());
  }
  SiftParams params;
  params.engine = GetParam();
  params.min_scale_m = 1.2 * ball->spacing_m;
  params.min_contrast = 0.01;
  const std::vector<Place> ours = our_places(*ball, params);
  const std::vector<Place> theirs = pcl_places(*ball, params);
  EXPECT_GT(theirs.size(), 20U);
  EXPECT_EQ(in_common(ours, theirs), theirs.size());
  EXPECT_EQ(ours.size(), theirs.size());
}

TEST_P(SiftAgainstPcl, FindsTheSameBlobsOnAColouredMilkCarton) {
  const std::filesystem::path file = test::recorded_data("pcl_test/milk_color.pcd");
  if (file.empty()) GTEST_SKIP() << test::kNoRecordedData;
  const CloudData cloud = read_cloud(file);
  ASSERT_TRUE(cloud.has_color());
  test::OwnedSurface milk = test::surface_of(cloud);
  ASSERT_EQ(milk->size, cloud.size());
  for (std::size_t i = 0; i < milk->size; ++i) {
    const Rgb8& c = cloud.color[i];
    milk->intensity[i] = static_cast<float>(299 * c.r + 587 * c.g + 114 * c.b) / 255000.0F;
  }
  SiftParams params;
  params.engine = GetParam();
  params.min_scale_m = 0.003;
  params.min_contrast = 0.02;
  const std::vector<Place> ours = our_places(*milk, params);
  const std::vector<Place> theirs = pcl_places(*milk, params);
  EXPECT_GT(theirs.size(), 10U);
  // A cube's centroid or an extremum may turn on the last bit of a single-precision sum.
  EXPECT_GE(in_common(ours, theirs) * 100, 97 * theirs.size());
  EXPECT_GE(in_common(theirs, ours) * 100, 97 * ours.size());
}

}  // namespace
}  // namespace grapnel
