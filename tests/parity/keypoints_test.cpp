// PCL's own expected numbers for keypoints and curvatures, from the tests named at each case.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <vector>

#include "base/cloud_file.h"
#include "pipeline/keypoints/sift3d.h"
#include "pipeline/preprocess/normals.h"
#include "pipeline/preprocess/principal_curvature.h"
#include "tests/pipeline/support/surfaces.h"
#include "tests/support/recorded_data.h"

namespace grapnel {
namespace {

class BothEngines : public testing::TestWithParam<Engine> {};
INSTANTIATE_TEST_SUITE_P(Published, BothEngines, testing::Values(Engine::Fast, Engine::Reference));

// test_curvatures_estimation.cpp: normals of the 10 nearest points, curvatures of the whole cloud.
TEST_P(BothEngines, GiveThePrincipalCurvaturesOfTheBunny) {
  const std::filesystem::path file = test::recorded_data("pcl_test/bun0.pcd");
  if (file.empty()) GTEST_SKIP() << test::kNoRecordedData;
  test::OwnedSurface bunny = test::surface_of(read_cloud(file));
  ASSERT_EQ(bunny->size, 397U);
  PcaNormalsParams normal_params;
  normal_params.k = 10;
  PcaNormals normals(normal_params);
  CurvatureParams params;
  params.engine = GetParam();
  params.radius_m = 10.0;
  PrincipalCurvature curvature(params);
  const test::ArenaMemory memory([&](Arena& arena) {
    normals.reserve(arena, test::small_limits());
    curvature.reserve(arena, test::small_limits());
  });
  ASSERT_TRUE(normals.estimate(*bunny).ok());
  ASSERT_TRUE(curvature.estimate(*bunny).ok());
  struct Expected {
    std::size_t point;
    std::array<double, 3> direction;
    double pc1, pc2;
  };
  const std::vector<Expected> expected = {
      {0, {0.98509, 0.10713, 0.13462}, 0.23997458815574646, 0.19400238990783691},
      {2, {0.98079, -0.04019, 0.19086}, 0.27207502722740173, 0.1946497857570648},
      {394, {0.86725, -0.37599, 0.32636}, 0.2590007483959198, 0.17906941473484039},
      {396, {0.86725, -0.375851, 0.32636}, 0.25900065898895264, 0.17906941473484039}};
  for (const Expected& e : expected) {
    EXPECT_NEAR(curvature.largest()[e.point], e.pc1, 1e-4) << e.point;
    EXPECT_NEAR(curvature.smallest()[e.point], e.pc2, 1e-4) << e.point;
    double cosine = 0.0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      cosine += e.direction[axis] * static_cast<double>(curvature.direction(axis)[e.point]);
    }
    // PCL states the components of point 0 without sign. Its directions turn by up to 0.01 rad with
    // the last digits of normals of ten points in single precision; with the same normals they
    // agree (tests/parity/pcl).
    EXPECT_GT(std::fabs(cosine), e.point == 0 ? 0.9 : 0.9999) << e.point;
  }
}

class PclTurtle : public testing::TestWithParam<Engine> {
 protected:
  void SetUp() override {
    const std::filesystem::path file = test::recorded_data("pcl_test/cturtle.pcd");
    if (file.empty()) GTEST_SKIP() << test::kNoRecordedData;
    const CloudData cloud = read_cloud(file);
    ASSERT_EQ(cloud.size(), 167198U);
    surface_ = std::make_unique<test::OwnedSurface>(test::surface_of(cloud));
    ASSERT_EQ((*surface_)->size, cloud.size());
    std::copy(cloud.intensity.begin(), cloud.intensity.end(), (*surface_)->intensity.begin());
  }

  struct Place {
    Vec3f at;
    float scale_m = 0.0F;
  };
  std::vector<Place> sift(double scale_m, double contrast) {
    SiftParams params;
    params.engine = GetParam();
    params.min_scale_m = scale_m;
    params.octaves = 5;
    params.scales_per_octave = 3;
    params.min_contrast = contrast;
    SiftDetector detector(params);
    Limits limits = test::small_limits();
    limits.max_points = (*surface_)->size;
    KeypointSet set;
    const test::ArenaMemory memory([&](Arena& arena) {
      detector.reserve(arena, limits);
      set = KeypointSet(arena.take<Keypoint>(1000));
    });
    EXPECT_TRUE(detector.detect(**surface_, set).ok());
    std::vector<Place> places;
    for (const Keypoint& keypoint : set) {
      places.push_back(
          {(*surface_)->point(static_cast<std::size_t>(keypoint.point)) + keypoint.offset_m,
           keypoint.scale_m});
    }
    return places;
  }

  std::unique_ptr<test::OwnedSurface> surface_;
};
INSTANTIATE_TEST_SUITE_P(BothEngines, PclTurtle, testing::Values(Engine::Fast, Engine::Reference));

// test_keypoints.cpp, SIFTKeypoint, first part.
TEST_P(PclTurtle, Holds169SiftKeypointsOfFineScale) { EXPECT_EQ(sift(0.02, 0.03).size(), 169U); }

// test_keypoints.cpp, SIFTKeypoint, second part.
TEST_P(PclTurtle, HoldsFiveSiftKeypointsOfCoarseScale) {
  const std::vector<Place> found = sift(0.05, 0.06);
  const std::vector<Place> expected = {{{-0.9425F, -0.6381F, 1.6445F}, 0.0794F},
                                       {{-0.5083F, -0.5587F, 1.8519F}, 0.0500F},
                                       {{1.0265F, 0.0500F, 1.7154F}, 0.1000F},
                                       {{0.3005F, -0.3007F, 1.9526F}, 0.2000F},
                                       {{-0.1002F, -0.1002F, 1.9933F}, 0.3175F}};
  ASSERT_EQ(found.size(), expected.size());
  for (const Place& e : expected) {
    EXPECT_TRUE(std::any_of(found.begin(), found.end(), [&](const Place& p) {
      return (p.at - e.at).cwiseAbs().maxCoeff() <= 1e-4F &&
             std::fabs(p.scale_m - e.scale_m) <= 1e-4F;
    })) << e.at.transpose();
  }
}

}  // namespace
}  // namespace grapnel
