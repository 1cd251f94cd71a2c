// PCL's own expected numbers for descriptors, from the tests named at each case, on the cloud those
// tests load.
#include <gtest/gtest.h>

#include <array>
#include <string>
#include <vector>

#include "base/cloud_file.h"
#include "pipeline/descriptors/pair_feature.h"
#include "pipeline/descriptors/pfh.h"
#include "pipeline/descriptors/spin_image.h"
#include "pipeline/preprocess/normals.h"
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
  }
  CloudData cloud_;
};

class PclDescriptors : public PclBunny, public testing::WithParamInterface<Engine> {};

INSTANTIATE_TEST_SUITE_P(BothEngines, PclDescriptors,
                         testing::Values(Engine::Fast, Engine::Reference), [](const auto& engine) {
                           return engine.param == Engine::Fast ? "Fast" : "Reference";
                         });

Limits bunny_limits() {
  Limits limits = test::small_limits();
  limits.max_keypoints = 397;
  return limits;
}

struct Rows {
  FeatureMatrix features;
  test::ArenaMemory memory;
  Rows(DescriptorEstimator& estimator, const Surface& surface,
       const std::vector<std::int32_t>& points)
      : memory([&](Arena& arena) {
          estimator.reserve(arena, bunny_limits());
          features.reserve(arena, points.size(), estimator.dimension());
        }) {
    std::vector<Keypoint> keypoints;
    for (const std::int32_t point : points) keypoints.push_back({point, 1.0F, 0.0F});
    EXPECT_TRUE(estimator.describe(surface, keypoints, features).ok());
  }
};

PfhParams whole_cloud(int bins, Engine engine) {
  PfhParams params;
  params.radius_m = 10.0;
  params.bins = bins;
  params.max_neighbours = 397;
  params.engine = engine;
  return params;
}

// test_pfh_estimation.cpp, PFHEstimation: computePairFeatures of points 0 and 12.
TEST_F(PclBunny, FeaturesOfAPair) {
  test::OwnedSurface surface = test::surface_of(cloud_);
  const auto place = [&](std::size_t i) -> Vec3d { return surface->point(i).cast<double>(); };
  const auto normal = [&](std::size_t i) -> Vec3d { return surface->normal(i).cast<double>(); };
  const PairFeature pair = pair_feature(place(0), normal(0), place(12), normal(12));
  ASSERT_TRUE(pair.valid);
  EXPECT_NEAR(pair.f1_rad, -0.072575, 1e-4);
  EXPECT_NEAR(pair.f2, -0.040221, 1e-4);
  EXPECT_NEAR(pair.f3, 0.068133, 1e-4);
  EXPECT_NEAR(pair.distance_m, 0.006130, 1e-4);
}

// test_ppf_estimation.cpp: three of all pairs. Their fifth number, a turn about the first normal,
// counts from a direction that every implementation chooses for itself.
TEST_F(PclBunny, FeaturesOfThreePointPairs) {
  test::OwnedSurface surface = test::surface_of(cloud_);
  surface->spacing_m = 0.01;
  PcaNormalsParams params;
  params.k = 10;
  PcaNormals normals(params);
  const test::ArenaMemory memory([&](Arena& arena) { normals.reserve(arena, bunny_limits()); });
  ASSERT_TRUE(normals.estimate(*surface).ok());
  struct Expected {
    std::size_t first, second;
    double f1_rad, f2, f3, distance_m;
  };
  for (const Expected& e : {Expected{38, 41, -2.51637, -0.00365916, -0.521141, 0.0106809},
                            Expected{76, 82, 0.185142, 0.0425001, -0.191276, 0.0138508},
                            Expected{114, 123, -1.96263, -0.431919, 0.868716, 0.140129}}) {
    const PairFeature pair = pair_feature(
        surface->point(e.first).cast<double>(), surface->normal(e.first).cast<double>(),
        surface->point(e.second).cast<double>(), surface->normal(e.second).cast<double>());
    ASSERT_TRUE(pair.valid);
    EXPECT_NEAR(pair.f1_rad, e.f1_rad, 1e-4) << e.first;
    EXPECT_NEAR(pair.f2, e.f2, 1e-4) << e.first;
    EXPECT_NEAR(pair.f3, e.f3, 1e-4) << e.first;
    EXPECT_NEAR(pair.distance_m, e.distance_m, 1e-4) << e.first;
  }
}

/// The same count of pairs as PCL sums it: one float increment a pair, whose rounding adds up.
double as_pcl_adds(float percent, std::size_t pairs) {
  const auto all = static_cast<double>(pairs);
  const auto count = static_cast<int>(static_cast<double>(percent) * all / 100.0 + 0.5);
  const float increment = 100.0F / static_cast<float>(pairs);
  float sum = 0.0F;
  for (int i = 0; i < count; ++i) sum += increment;
  return static_cast<double>(sum);
}

// test_pfh_estimation.cpp, PFHEstimation: computePointPFHSignature, 3 bins, the whole cloud.
TEST_P(PclDescriptors, PfhOfTwentySevenBins) {
  test::OwnedSurface surface = test::surface_of(cloud_);
  PfhEstimator pfh(whole_cloud(3, GetParam()));
  const Rows rows(pfh, *surface, {0});
  constexpr std::array<double, 27> kExpected = {
      0.932506, 2.32429, 0.357477, 0.848541, 3.65565, 0.178104, 1.45284,  3.60666, 0.298959,
      0.295143, 2.13474, 0.41218,  0.165382, 8.97407, 0.306592, 0.455432, 4.5977,  0.393097,
      7.54668,  6.78336, 1.63858,  9.93842,  18.4947, 1.96553,  8.04793,  11.2793, 2.91714};
  double sum = 0.0;
  for (std::size_t bin = 0; bin < 27; ++bin) {
    // PCL's own tolerances: pairs with an angle of zero stand on a border of bins 4 and 22.
    const double tolerance = bin == 4 || bin == 22 ? 2e-2 : bin >= 23 ? 1e-4 : 1e-2;
    const double value = as_pcl_adds(rows.features.row(0)[bin], 397 * 396 / 2);
    EXPECT_NEAR(value, kExpected[bin], tolerance) << bin;
    sum += value;
  }
  EXPECT_NEAR(sum, 100.0, 1e-2);
}

// test_pfh_estimation.cpp, PFHEstimation: compute, all points the neighbours of every point.
TEST_P(PclDescriptors, PfhOfAHundredAndTwentyFiveBins) {
  test::OwnedSurface surface = test::surface_of(cloud_);
  PfhEstimator pfh(whole_cloud(5, GetParam()));
  const Rows rows(pfh, *surface, {0, 100, 396});
  // Bins 21 and 22 are commented out in PCL's test.
  constexpr std::array<double, 27> kExpected = {
      0.156477,   0.539396, 0.410907,  0.184465,  0.115767, 0.0572475,  0.206092,
      0.339667,   0.265883, 0.0038165, 0.103046,  0.214997, 0.398186,   0.298959,
      0.00127217, 0.11704,  0.255706,  0.356205,  0.265883, 0.00127217, 0.148844,
      -1.0,       -1.0,     0.22263,   0.0216269, 0.223902, 0.07633};
  for (std::size_t row = 0; row < 3; ++row) {
    for (std::size_t bin = 0; bin < 27; ++bin) {
      if (kExpected[bin] < 0.0) continue;
      const double tolerance = bin == 12 ? 3e-2 : 1e-4;
      EXPECT_NEAR(rows.features.row(row)[bin], kExpected[bin], tolerance) << bin;
    }
  }
}

struct SpinCase {
  SpinStructure structure;
  SpinDomain domain;
  std::array<double, 13> at_100;  ///< every twelfth cell of the image at point 100
  std::array<double, 13> at_300;
};

const std::array<SpinCase, 4> kSpinCases = {{
    {SpinStructure::Radial,
     SpinDomain::Density,
     {0, 0, 0.00233226, 0, 8.48662e-5, 0.0266387, 0, 0, 0.0414662, 0, 0, 0, 0.0128513},
     {0, 0, 0.00932424, 0, 0, 0.0145733, 0, 0, 0.00034457, 0, 0, 0, 0.0121195}},
    {SpinStructure::Radial,
     SpinDomain::Angular,
     {0, 0, 0.132139, 0, 0.908814, 0.63875, 0, 0, 0.550392, 0, 0, 0, 0.257136},
     {0, 0, 0.230605, 0, 0, 0.764872, 0, 0, 1.02824, 0, 0, 0, 0.293567}},
    {SpinStructure::Rectangular,
     SpinDomain::Density,
     {0, 0, 0.000889345, 0, 0, 0.0489534, 0, 0, 0.0747141, 0, 0, 0.0173423, 0},
     {0, 0, 0.0267132, 0, 0, 0, 0, 0, 0, 0.0209709, 0, 0, 0.029372}},
    {SpinStructure::Rectangular,
     SpinDomain::Angular,
     {0, 0, 0.132139, 0, 0, 0.38800787925720215, 0, 0, 0.468881, 0, 0, 0.67901438474655151, 0},
     {0, 0, 0.143845, 0, 0, 0, 0, 0, 0, 0.706084, 0, 0, 0.272542}},
}};

// test_spin_estimation.cpp, SpinImageEstimation: normals within 40 mm, images within 80 mm.
TEST_P(PclDescriptors, SpinImagesOfAllFourKinds) {
  test::OwnedSurface surface = test::surface_of(cloud_);
  PcaNormalsParams normal_params;
  normal_params.radius_m = 0.04;
  PcaNormals normals(normal_params);
  const test::ArenaMemory memory([&](Arena& arena) { normals.reserve(arena, bunny_limits()); });
  ASSERT_TRUE(normals.estimate(*surface).ok());
  for (const SpinCase& expected : kSpinCases) {
    SpinImageParams params;
    params.radius_m = 0.08;
    params.width = 8;
    params.min_cos = 0.5;
    params.min_neighbours = 16;
    params.structure = expected.structure;
    params.domain = expected.domain;
    params.engine = GetParam();
    SpinImageEstimator spin(params);
    const Rows rows(spin, *surface, {100, 300});
    const std::string kind = std::to_string(static_cast<int>(expected.structure)) + " " +
                             std::to_string(static_cast<int>(expected.domain));
    for (std::size_t i = 0; i < 13; ++i) {
      EXPECT_NEAR(rows.features.row(0)[12 * i], expected.at_100[i], 1e-4) << kind << " " << i;
      EXPECT_NEAR(rows.features.row(1)[12 * i], expected.at_300[i], 1e-4) << kind << " " << i;
    }
  }
}

// test_spin_estimation.cpp: three normals of the same estimate.
TEST_F(PclBunny, NormalsWithinFortyMillimetres) {
  test::OwnedSurface surface = test::surface_of(cloud_);
  PcaNormalsParams params;
  params.radius_m = 0.04;
  PcaNormals normals(params);
  const test::ArenaMemory memory([&](Arena& arena) { normals.reserve(arena, bunny_limits()); });
  ASSERT_TRUE(normals.estimate(*surface).ok());
  const std::array<std::pair<std::size_t, Vec3f>, 3> expected = {{
      {103, {0.36683175F, -0.44696972F, -0.81587529F}},
      {200, {-0.71414840F, -0.06002361F, -0.69741613F}},
      {140, {-0.45109111F, -0.19499126F, -0.87091631F}},
  }};
  for (const auto& [point, normal] : expected) {
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      EXPECT_NEAR(surface->normal(point)[axis], normal[axis], 1e-4) << point;
    }
  }
}

}  // namespace
}  // namespace grapnel
