#include "pipeline/descriptors/pfh.h"

#include <gtest/gtest.h>

#include <numeric>
#include <vector>

#include "tests/pipeline/support/surfaces.h"

namespace grapnel {
namespace {

class Pfh : public testing::TestWithParam<Engine> {
 protected:
  /// Describes one point by all points within `radius_m`.
  void describe(const Surface& surface, double radius_m) {
    PfhParams params;
    params.radius_m = radius_m;
    params.engine = GetParam();
    PfhEstimator pfh(params);
    const test::ArenaMemory memory([&](Arena& arena) { pfh.reserve(arena, test::small_limits()); });
    const std::vector<Keypoint> keypoint = {{0, 1.0F, 0.0F}};
    ASSERT_TRUE(pfh.describe(surface, keypoint, features_).ok());
    row_ = features_.row(0);
  }
  FeatureMatrix features_;
  test::ArenaMemory memory_{[this](Arena& arena) { features_.reserve(arena, 1, 125); }};
  std::span<float> row_;
};

INSTANTIATE_TEST_SUITE_P(BothEngines, Pfh, testing::Values(Engine::Fast, Engine::Reference));

TEST_P(Pfh, OfAPlaneIsInTheMiddleCellAlone) {
  // Equal normals across the line: all three features are 0, the middle of five bins each.
  test::OwnedSurface plane(100, 0);
  plane->size = 100;
  for (std::size_t i = 0; i < 100; ++i) {
    plane->x[i] = static_cast<float>(i % 10) * 0.01F;
    plane->y[i] = static_cast<float>(i / 10) * 0.01F;
    plane->nz[i] = 1.0F;
  }
  describe(*plane, 0.05);
  EXPECT_NEAR(row_[2 + 5 * 2 + 25 * 2], 100.0, 1e-4);
}

TEST_P(Pfh, OfASphereHasNoSecondFeature) {
  // Both normals and the line lie in one plane through the centre, so that v · n = 0.
  test::OwnedSurface ball = test::sphere(800, 0.1, true);
  describe(*ball, 0.05);
  double middle = 0.0;
  for (std::size_t cell = 0; cell < 125; ++cell) {
    if (cell / 5 % 5 == 2) middle += static_cast<double>(row_[cell]);
  }
  EXPECT_NEAR(middle, 100.0, 1e-3);
}

TEST_P(Pfh, CountsThePointItselfAndLeavesOutPointsWithoutNormal) {
  // Three points with normals make three pairs; a fourth without one makes none.
  test::OwnedSurface four(4, 0);
  four->size = 4;
  for (std::size_t i = 0; i < 4; ++i) four->x[i] = static_cast<float>(i * i) * 0.01F;
  for (std::size_t i = 0; i < 3; ++i) four->nz[i] = 1.0F;
  four->nx[2] = 0.6F;
  four->nz[2] = 0.8F;
  describe(*four, 1.0);
  std::vector<float> shares;
  for (const float value : row_) {
    if (value > 0.0F) shares.push_back(value);
  }
  EXPECT_NEAR(std::accumulate(shares.begin(), shares.end(), 0.0), 100.0, 1e-4);
  for (const float share : shares) {
    EXPECT_NEAR(share / (100.0 / 3.0), std::round(share / (100.0 / 3.0)), 1e-5);
  }
}

TEST_P(Pfh, HasADimensionOfTheCubeOfItsBins) {
  PfhParams params;
  params.bins = 3;
  EXPECT_EQ(PfhEstimator(params).dimension(), 27U);
}

}  // namespace
}  // namespace grapnel
