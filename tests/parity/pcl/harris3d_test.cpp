// Harris 3D against PCL's, which states no numbers of its own: every response at every point, the
// keypoints, and the refined corners.
#include <gtest/gtest.h>
#include <pcl/features/normal_3d.h>
#include <pcl/keypoints/harris_3d.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "pipeline/keypoints/harris3d.h"
#include "pipeline/preprocess/normals.h"
#include "tests/parity/pcl/clouds.h"
#include "tests/support/recorded_data.h"

namespace grapnel {
namespace {

using PclHarris = pcl::HarrisKeypoint3D<pcl::PointXYZ, pcl::PointXYZI, pcl::Normal>;

struct Kind {
  std::string name;
  HarrisResponse ours;
  PclHarris::ResponseMethod theirs;
};

PclHarris::ResponseMethod method_of(HarrisResponse response) {
  switch (response) {
    case HarrisResponse::Harris:
      return PclHarris::HARRIS;
    case HarrisResponse::Noble:
      return PclHarris::NOBLE;
    case HarrisResponse::Lowe:
      return PclHarris::LOWE;
    case HarrisResponse::Tomasi:
      return PclHarris::TOMASI;
    case HarrisResponse::Curvature:
      break;
  }
  return PclHarris::CURVATURE;
}

/// Both libraries' results on one cloud with the same normals.
struct Both {
  pcl::PointCloud<pcl::PointXYZI> theirs;
  std::vector<int> their_points;
  HarrisDetector detector;
  KeypointSet ours;
  test::ArenaMemory memory;

  Both(Surface& surface, const HarrisParams& params)
      : detector(params), memory([&](Arena& arena) {
          detector.reserve(arena, test::limits_for(surface));
          ours = KeypointSet(arena.take<Keypoint>(surface.size));
        }) {
    EXPECT_TRUE(detector.detect(surface, ours).ok());
    PclHarris harris(method_of(params.response), static_cast<float>(params.radius_m),
                     static_cast<float>(params.threshold));
    harris.setNonMaxSupression(params.suppress);
    harris.setRefine(params.refine);
    harris.setNumberOfThreads(1);
    const auto cloud = test::pcl_points(surface);
    auto normals = test::pcl_normals(surface);
    if (params.response == HarrisResponse::Curvature) {
      pcl::NormalEstimation<pcl::PointXYZ, pcl::Normal> estimation;
      estimation.setInputCloud(cloud);
      estimation.setRadiusSearch(params.radius_m);
      estimation.compute(*normals);
    }
    harris.setInputCloud(cloud);
    harris.setNormals(normals);
    harris.compute(theirs);
    for (const int index : harris.getKeypointsIndices()->indices) their_points.push_back(index);
  }
};

void add_normals(Surface& surface, double radius_m) {
  PcaNormalsParams params;
  params.radius_m = radius_m;
  PcaNormals normals(params);
  const test::ArenaMemory memory(
      [&](Arena& arena) { normals.reserve(arena, test::limits_for(surface)); });
  ASSERT_TRUE(normals.estimate(surface).ok());
}

struct Case {
  HarrisResponse response;
  Engine engine;
};

class HarrisAgainstPcl : public testing::TestWithParam<Case> {
 protected:
  HarrisParams params(double radius_m, bool suppress) const {
    HarrisParams params;
    params.engine = GetParam().engine;
    params.response = GetParam().response;
    params.radius_m = radius_m;
    params.threshold = suppress ? 1e-4 : -1.0;
    params.suppress = suppress;
    params.refine = false;
    return params;
  }

  // PCL sums products of unit vectors in single precision; so does the fast engine. Its smallest
  // eigenvalue comes from the cubic's roots in single precision, good to about the root of its
  // epsilon.
  static double tolerance() { return GetParam().response == HarrisResponse::Tomasi ? 3e-4 : 2e-6; }

  void expect_equal_responses(Surface& surface, double radius_m) const {
    const Both both(surface, params(radius_m, false));
    ASSERT_EQ(both.theirs.size(), surface.size);
    for (std::size_t i = 0; i < surface.size; ++i) {
      ASSERT_NEAR(both.detector.responses()[i], both.theirs[i].intensity, tolerance()) << i;
    }
  }

  void expect_equal_keypoints(Surface& surface, double radius_m) const {
    Both both(surface, params(radius_m, true));
    std::vector<int> ours;
    for (const Keypoint& keypoint : both.ours) ours.push_back(keypoint.point);
    std::sort(both.their_points.begin(), both.their_points.end());
    std::vector<int> common;
    std::set_intersection(ours.begin(), ours.end(), both.their_points.begin(),
                          both.their_points.end(), std::back_inserter(common));
    EXPECT_GE(common.size(), 5U);
    const std::size_t most = std::max(ours.size(), both.their_points.size());
    EXPECT_GE(common.size() + std::max<std::size_t>(2, most / 20), most);
    // Of points whose responses are equal to what they are good to, or that lie at the threshold,
    // either may be the one.
    std::vector<int> of_one;
    std::set_symmetric_difference(ours.begin(), ours.end(), both.their_points.begin(),
                                  both.their_points.end(), std::back_inserter(of_one));
    for (const int point : of_one) {
      EXPECT_TRUE(is_close_call(surface, both, static_cast<std::size_t>(point), radius_m)) << point;
    }
  }

  static bool is_close_call(const Surface& surface, const Both& both, std::size_t point,
                            double radius_m) {
    const auto response = [&](std::size_t i) {
      return static_cast<double>(both.detector.responses()[i]);
    };
    if (response(point) < 1e-4 + tolerance()) return true;
    const auto reach_m = static_cast<float>(radius_m);
    for (std::size_t i = 0; i < surface.size; ++i) {
      if (i == point || (surface.point(i) - surface.point(point)).norm() > reach_m) continue;
      if (std::fabs(response(i) - response(point)) <= 2.0 * tolerance()) return true;
    }
    return false;
  }
};

INSTANTIATE_TEST_SUITE_P(EveryResponse, HarrisAgainstPcl,
                         testing::Values(Case{HarrisResponse::Harris, Engine::Fast},
                                         Case{HarrisResponse::Noble, Engine::Fast},
                                         Case{HarrisResponse::Lowe, Engine::Fast},
                                         Case{HarrisResponse::Tomasi, Engine::Fast},
                                         Case{HarrisResponse::Curvature, Engine::Fast},
                                         Case{HarrisResponse::Harris, Engine::Reference},
                                         Case{HarrisResponse::Noble, Engine::Reference},
                                         Case{HarrisResponse::Lowe, Engine::Reference},
                                         Case{HarrisResponse::Tomasi, Engine::Reference},
                                         Case{HarrisResponse::Curvature, Engine::Reference}));

TEST_P(HarrisAgainstPcl, RespondsAlikeOnABumpyBall) {
  test::OwnedSurface ball = test::bumpy_ball(3000, 0.2);
  add_normals(*ball, 3.0 * ball->spacing_m);
  expect_equal_responses(*ball, 4.0 * ball->spacing_m);
  expect_equal_keypoints(*ball, 4.0 * ball->spacing_m);
}

TEST_P(HarrisAgainstPcl, RespondsAlikeOnACamerasGrid) {
  test::OwnedSurface grid = test::wavy_grid(80, 60, 3);
  add_normals(*grid, 4.0 * grid->spacing_m);
  expect_equal_responses(*grid, 5.0 * grid->spacing_m);
  expect_equal_keypoints(*grid, 5.0 * grid->spacing_m);
}

TEST_P(HarrisAgainstPcl, RespondsAlikeOnTheBunny) {
  test::OwnedSurface bunny = test::recorded_surface("pcl_test/bun0.pcd");
  if (bunny->size == 0) GTEST_SKIP() << test::kNoRecordedData;
  add_normals(*bunny, 0.02);
  expect_equal_responses(*bunny, 0.02);
  expect_equal_keypoints(*bunny, 0.02);
}

TEST_P(HarrisAgainstPcl, RespondsAlikeOnTheMilkCarton) {
  test::OwnedSurface milk = test::recorded_surface("pcl_test/milk.pcd");
  if (milk->size == 0) GTEST_SKIP() << test::kNoRecordedData;
  add_normals(*milk, 0.006);
  expect_equal_responses(*milk, 0.01);
  expect_equal_keypoints(*milk, 0.01);
}

TEST(HarrisAgainstPcl, RefinesTheSameCorners) {
  test::OwnedSurface ball = test::bumpy_ball(3000, 0.2);
  add_normals(*ball, 3.0 * ball->spacing_m);
  HarrisParams params;
  params.radius_m = 4.0 * ball->spacing_m;
  params.threshold = 1e-4;
  const Both both(*ball, params);
  ASSERT_EQ(both.ours.size(), both.their_points.size());
  for (std::size_t k = 0; k < both.ours.size(); ++k) {
    const auto theirs =
        std::find(both.their_points.begin(), both.their_points.end(), both.ours[k].point);
    ASSERT_NE(theirs, both.their_points.end());
    const auto at = static_cast<std::size_t>(theirs - both.their_points.begin());
    const Vec3f place =
        ball->point(static_cast<std::size_t>(both.ours[k].point)) + both.ours[k].offset_m;
    // PCL solves in single precision, its condition up to 1e4: 1e-7 * 1e4 of 0.2 m at worst.
    EXPECT_LT((place - both.theirs[at].getVector3fMap()).norm(), 2e-4F);
  }
}

}  // namespace
}  // namespace grapnel
