#include "pipeline/descriptors/spin_image.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <vector>

#include "tests/pipeline/support/surfaces.h"

namespace grapnel {
namespace {

class SpinImage : public testing::TestWithParam<Engine> {
 protected:
  void describe(const Surface& surface, SpinImageParams params) {
    params.engine = GetParam();
    SpinImageEstimator spin(params);
    const test::ArenaMemory memory(
        [&](Arena& arena) { spin.reserve(arena, test::small_limits()); });
    const std::vector<Keypoint> keypoint = {{0, 1.0F, 0.0F}};
    ASSERT_TRUE(spin.describe(surface, keypoint, features_).ok());
  }
  [[nodiscard]] float cell(std::size_t row, std::size_t column) const {
    return features_.row(0)[row * 17 + column];
  }
  FeatureMatrix features_;
  test::ArenaMemory memory_{[this](Arena& arena) { features_.reserve(arena, 1, 153); }};
};

INSTANTIATE_TEST_SUITE_P(BothEngines, SpinImage, testing::Values(Engine::Fast, Engine::Reference));

/// The described point at the origin with its normal along z, and one neighbour.
test::OwnedSurface two_points(const Vec3f& neighbour, const Vec3f& normal) {
  test::OwnedSurface two(2, 0);
  two->size = 2;
  two->nz[0] = 1.0F;
  two->x[1] = neighbour.x();
  two->y[1] = neighbour.y();
  two->z[1] = neighbour.z();
  two->nx[1] = normal.x();
  two->ny[1] = normal.y();
  two->nz[1] = normal.z();
  return two;
}

SpinImageParams cells_of_a_centimetre() {
  SpinImageParams params;
  params.radius_m = 0.08 * std::sqrt(2.0);
  return params;
}

TEST_P(SpinImage, SharesAVoteAmongFourCells) {
  // 3.5 cells from the axis, 1.25 above the tangent plane, whose column is the middle one, 8.
  describe(*two_points({0.035F, 0.0F, 0.0125F}, {0.0F, 0.0F, 1.0F}), cells_of_a_centimetre());
  EXPECT_NEAR(cell(3, 9), 0.5 * 0.75, 1e-5);
  EXPECT_NEAR(cell(4, 9), 0.5 * 0.75, 1e-5);
  EXPECT_NEAR(cell(3, 10), 0.5 * 0.25, 1e-5);
  EXPECT_NEAR(cell(4, 10), 0.5 * 0.25, 1e-5);
}

TEST_P(SpinImage, RadialCellsAreDistanceAndElevation) {
  // At 45 degrees: half of the way from the middle column to the last; 4.5 cells away.
  SpinImageParams params;
  params.radius_m = 0.08;
  params.structure = SpinStructure::Radial;
  const float part = 0.045F / std::sqrt(2.0F);
  describe(*two_points({0.0F, part, part}, {0.0F, 0.0F, 1.0F}), params);
  EXPECT_NEAR(cell(4, 12), 0.5, 1e-4);
  EXPECT_NEAR(cell(5, 12), 0.5, 1e-4);
}

TEST_P(SpinImage, AngularCellsHoldTheAngleBetweenTheNormalsLines) {
  SpinImageParams params = cells_of_a_centimetre();
  params.domain = SpinDomain::Angular;
  // Turned by 0.3 rad and reversed: the angle between the lines is still 0.3.
  const Vec3f reversed(-std::sin(0.3F), 0.0F, -std::cos(0.3F));
  describe(*two_points({0.035F, 0.0F, 0.0125F}, reversed), params);
  EXPECT_NEAR(cell(3, 9), 0.3, 1e-4);
  EXPECT_NEAR(cell(4, 10), 0.3, 1e-4);
  EXPECT_EQ(cell(0, 8), 0.0F);
}

TEST_P(SpinImage, LeavesOutNormalsThatLeanAndPointsOutsideTheCylinder) {
  SpinImageParams params = cells_of_a_centimetre();
  params.min_cos = 0.9;
  const Vec3f leaning(0.6F, 0.0F, 0.8F);
  describe(*two_points({0.035F, 0.0F, 0.0125F}, leaning), params);
  for (const float value : features_.row(0)) EXPECT_EQ(value, 0.0F);
  describe(*two_points({0.085F, 0.0F, 0.0F}, {0.0F, 0.0F, 1.0F}), params);
  for (const float value : features_.row(0)) EXPECT_EQ(value, 0.0F);
}

TEST_P(SpinImage, WithTooFewNeighboursIsZero) {
  SpinImageParams params = cells_of_a_centimetre();
  params.min_neighbours = 3;
  describe(*two_points({0.035F, 0.0F, 0.0125F}, {0.0F, 0.0F, 1.0F}), params);
  for (const float value : features_.row(0)) EXPECT_EQ(value, 0.0F);
}

TEST_P(SpinImage, OfAPlaneIsItsMiddleColumnAlone) {
  test::OwnedSurface plane(400, 0);
  plane->size = 400;
  for (std::size_t i = 0; i < 400; ++i) {
    plane->x[i] = static_cast<float>(i % 20) * 0.005F;
    plane->y[i] = static_cast<float>(i / 20) * 0.005F;
    plane->nz[i] = 1.0F;
  }
  describe(*plane, cells_of_a_centimetre());
  double middle = 0.0;
  for (std::size_t row = 0; row < 9; ++row) middle += static_cast<double>(cell(row, 8));
  EXPECT_NEAR(middle, 1.0, 1e-5);
}

}  // namespace
}  // namespace grapnel
