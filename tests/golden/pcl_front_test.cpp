// PCL's own expected numbers, from the tests named at each case, on the cloud those tests load.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <vector>

#include "base/cloud_file.h"
#include "pipeline/descriptors/fpfh.h"
#include "pipeline/keypoints/iss.h"
#include "pipeline/preprocess/normals.h"
#include "pipeline/preprocess/voxel.h"
#include "tests/pipeline/support/surfaces.h"
#include "tests/support/recorded_data.h"

namespace grapnel {
namespace {

class PclBunny : public testing::Test {
 protected:
  void SetUp() override {
    const std::filesystem::path file = test::recorded_data("pcl_test/bun0.pcd");
    if (file.empty()) GTEST_SKIP() << test::kNoRecordedData;
    cloud_ = read_cloud(file);
    ASSERT_EQ(cloud_.size(), 397U);
    limits_ = test::small_limits();
  }

  CloudData cloud_;
  Limits limits_;
};

// test_normal_estimation.cpp, NormalEstimation: all points are every point's neighbours.
TEST_F(PclBunny, NormalOfTheWholeCloudAndItsCurvature) {
  test::OwnedSurface surface = test::surface_of(cloud_);
  PcaNormalsParams params;
  params.k = 397;
  PcaNormals normals(params);
  const test::ArenaMemory memory([&](Arena& arena) { normals.reserve(arena, limits_); });
  ASSERT_TRUE(normals.estimate(*surface).ok());
  for (std::size_t i = 0; i < surface->size; ++i) {
    ASSERT_NEAR(surface->nx[i], -0.035592, 1e-4);
    ASSERT_NEAR(surface->ny[i], -0.369596, 1e-4);
    ASSERT_NEAR(surface->nz[i], -0.928511, 1e-4);
    ASSERT_NEAR(normals.curvature()[i], 0.0693136, 1e-4);
  }
}

void expect_keypoints(const Surface& surface, const KeypointSet& keypoints,
                      std::vector<Vec3f> expected) {
  ASSERT_EQ(keypoints.size(), expected.size());
  for (const Vec3f& place : expected) {
    bool found = false;
    for (const Keypoint& keypoint : keypoints) {
      const Vec3f p = surface.point(static_cast<std::size_t>(keypoint.point));
      found = found || (p - place).cwiseAbs().maxCoeff() <= 1e-6F;
    }
    EXPECT_TRUE(found) << place.transpose();
  }
}

struct Keypoints {
  KeypointSet set;
  test::ArenaMemory memory{[this](Arena& arena) { set = KeypointSet(arena.take<Keypoint>(500)); }};
};

constexpr double kResolution_m = 0.0058329;

IssParams pcl_iss() {
  IssParams params;
  params.salient_radius_m = 6.0 * kResolution_m;
  params.non_max_radius_m = 4.0 * kResolution_m;
  params.normalise = false;
  return params;
}

// test_iss_3d.cpp, ISSKeypoint3D_WBE.
TEST_F(PclBunny, IssKeypointsWithoutBorders) {
  test::OwnedSurface surface = test::surface_of(cloud_);
  IssDetector iss(pcl_iss());
  const test::ArenaMemory memory([&](Arena& arena) { iss.reserve(arena, limits_); });
  Keypoints found;
  ASSERT_TRUE(iss.detect(*surface, found.set).ok());
  expect_keypoints(*surface, found.set,
                   {{-0.071112F, 0.137670F, 0.047518F},
                    {-0.041733F, 0.127960F, 0.016650F},
                    {-0.011943F, 0.086771F, 0.057009F},
                    {0.031733F, 0.099372F, 0.038505F},
                    {-0.062116F, 0.045145F, 0.037802F},
                    {-0.048250F, 0.167480F, -0.000152F}});
}

// test_iss_3d.cpp, ISSKeypoint3D_BE.
TEST_F(PclBunny, IssKeypointsAwayFromBorders) {
  test::OwnedSurface surface = test::surface_of(cloud_);
  PcaNormalsParams normal_params;
  normal_params.radius_m = 4.0 * kResolution_m;
  normal_params.min_neighbours = 3;
  PcaNormals normals(normal_params);
  IssParams params = pcl_iss();
  params.border_radius_m = 4.0 * kResolution_m;
  IssDetector iss(params);
  const test::ArenaMemory memory([&](Arena& arena) {
    normals.reserve(arena, limits_);
    iss.reserve(arena, limits_);
  });
  ASSERT_TRUE(normals.estimate(*surface).ok());
  Keypoints found;
  ASSERT_TRUE(iss.detect(*surface, found.set).ok());
  expect_keypoints(*surface, found.set,
                   {{-0.052037F, 0.116800F, 0.034582F},
                    {0.027420F, 0.096386F, 0.043312F},
                    {-0.011943F, 0.086771F, 0.057009F},
                    {-0.070344F, 0.087352F, 0.041908F},
                    {-0.030035F, 0.066130F, 0.038942F}});
}

// test_pfh_estimation.cpp, FPFHTest: the neighbourhood is the whole cloud.
struct Described {
  FpfhEstimator fpfh;
  FeatureMatrix features;
  std::vector<Keypoint> keypoints;
  test::ArenaMemory memory;

  Described(Surface& surface, const Limits& limits, Engine engine)
      : fpfh(params(engine)), keypoints(surface.size), memory([&](Arena& arena) {
          fpfh.reserve(arena, limits);
          features.reserve(arena, surface.size, FpfhEstimator::kDimension);
        }) {
    for (std::size_t i = 0; i < surface.size; ++i) {
      keypoints[i].point = static_cast<std::int32_t>(i);
    }
    EXPECT_TRUE(fpfh.describe(surface, keypoints, features).ok());
  }
  static FpfhParams params(Engine engine) {
    FpfhParams params;
    params.radius_m = 10.0;
    params.engine = engine;
    return params;
  }
};

class PclBunnyFpfh : public PclBunny, public testing::WithParamInterface<Engine> {};
INSTANTIATE_TEST_SUITE_P(BothEngines, PclBunnyFpfh,
                         testing::Values(Engine::Fast, Engine::Reference));

TEST_P(PclBunnyFpfh, SimplifiedHistogramOfTheFirstPoint) {
  test::OwnedSurface surface = test::surface_of(cloud_);
  Described described(*surface, limits_, GetParam());
  constexpr std::array<double, 33> kExpected = {
      0.757576, 0.757576, 4.54545,  19.697,  40.6566, 21.4647, 7.575759, 0.0,     0.0,
      0.50505,  4.0404,   0.757576, 1.51515, 6.31313, 9.59596, 20.7071,  18.9394, 15.9091,
      12.8788,  6.56566,  4.29293,  2.52525, 0.0,     5.05051, 4.54545,  5.05051, 1.76768,
      3.0303,   9.09091,  31.8182,  22.2222, 11.8687, 5.55556};
  for (std::size_t bin = 0; bin < 33; ++bin) {
    EXPECT_NEAR(described.fpfh.simplified(*surface, 0)[bin], kExpected[bin], 1e-4) << bin;
  }
}

TEST_P(PclBunnyFpfh, HistogramOfTheFirstPoint) {
  test::OwnedSurface surface = test::surface_of(cloud_);
  Described described(*surface, limits_, GetParam());
  constexpr std::array<double, 33> kExpected = {
      1.58591, 1.68365, 6.71,    23.0717, 33.3844, 20.4002, 7.31067, 1.02635, 0.48591,
      1.47069, 2.87061, 1.78321, 4.30795, 7.05514, 9.37615, 17.963,  18.2801, 14.2766,
      10.8542, 6.07925, 5.28565, 4.73887, 0.56984, 3.29826, 5.28156, 5.26939, 3.13191,
      1.74453, 9.41971, 21.5894, 24.6302, 17.7764, 7.28878};
  // PCL's own tolerance: rounding decides the bin of some pairs.
  for (std::size_t bin = 0; bin < 33; ++bin) {
    EXPECT_NEAR(described.features.row(0)[bin], kExpected[bin], 1e-2) << bin;
  }
}

// weightPointSPFHSignature: every point's simplified histogram, weighed as if point i were i m
// away.
TEST_P(PclBunnyFpfh, SimplifiedHistogramsOfAllPointsWeighed) {
  test::OwnedSurface surface = test::surface_of(cloud_);
  Described described(*surface, limits_, GetParam());
  std::array<double, 33> sum{};
  for (std::size_t i = 1; i < surface->size; ++i) {
    const auto row = described.fpfh.simplified(*surface, i);
    for (std::size_t bin = 0; bin < 33; ++bin) {
      sum[bin] += static_cast<double>(row[bin]) / static_cast<double>(i);
    }
  }
  constexpr std::array<double, 33> kExpected = {
      1.9798,  2.86927, 8.47911, 22.8784, 29.8597, 19.6877, 7.38611, 1.44265, 0.69677,
      1.72609, 2.99435, 2.26313, 5.16573, 8.3263,  9.92427, 16.8062, 16.2767, 12.251,
      10.354,  6.65578, 6.1437,  5.83341, 1.08809, 3.34133, 5.59236, 5.6355,  3.03257,
      1.37437, 7.99746, 18.0343, 23.691,  19.8475, 10.3655};
  for (std::size_t third = 0; third < 3; ++third) {
    double total = 0.0;
    for (std::size_t k = 0; k < 11; ++k) total += sum[11 * third + k];
    for (std::size_t k = 0; k < 11; ++k) {
      const std::size_t bin = 11 * third + k;
      // PCL's own tolerance.
      EXPECT_NEAR(100.0 * sum[bin] / total, kExpected[bin], 1e-2) << bin;
    }
  }
}

// test_filters.cpp, VoxelGrid: leaf 0.02.
TEST_F(PclBunny, VoxelsOfTwoCentimetres) {
  test::OwnedSurface surface = test::surface_of(cloud_);
  VoxelParams params;
  params.leaf_m = 0.02;
  VoxelGrid voxels(params);
  const test::ArenaMemory memory([&](Arena& arena) { voxels.reserve(arena, limits_); });
  const Result<std::size_t> removed = voxels.apply(*surface);
  ASSERT_TRUE(removed.ok());
  EXPECT_EQ(surface->size, 103U);
  EXPECT_EQ(removed.value(), 397U - 103U);
}

}  // namespace
}  // namespace grapnel
