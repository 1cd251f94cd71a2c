// PCL's own expected numbers for what comes before keypoints: test/filters/test_sampling.cpp and
// test_filters.cpp, test/features/test_ii_normals.cpp, test_boundary_estimation.cpp and
// test_base_feature.cpp, on the clouds they load.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <string>

#include "base/cloud_file.h"
#include "base/math.h"
#include "pipeline/preprocess/border_points.h"
#include "pipeline/preprocess/covariance_sampling.h"
#include "pipeline/preprocess/integral_image.h"
#include "pipeline/preprocess/integral_normals.h"
#include "pipeline/preprocess/normals.h"
#include "pipeline/preprocess/voxel_covariance.h"
#include "tests/pipeline/support/surfaces.h"
#include "tests/support/recorded_data.h"

namespace grapnel {
namespace {

Limits limits_of(const Surface& surface) {
  Limits limits = test::small_limits();
  limits.max_points = limits.max_input_points = limits.max_model_points = surface.size + 1;
  return limits;
}

class PclFront : public testing::Test {
 protected:
  static CloudData load(const char* file) {
    const std::filesystem::path path =
        test::recorded_data(("pcl_test/" + std::string(file)).c_str());
    return path.empty() ? CloudData{} : read_cloud(path);
  }
  static void estimate_normals(Surface& surface, const PcaNormalsParams& params) {
    surface.spacing_m = 0.01;
    PcaNormals normals(params);
    const test::ArenaMemory memory(
        [&](Arena& arena) { normals.reserve(arena, limits_of(surface)); });
    ASSERT_TRUE(normals.estimate(surface).ok());
  }
  static void sample(Surface& surface, std::size_t points) {
    CovarianceSampling sampling({static_cast<int>(points)});
    const test::ArenaMemory memory(
        [&](Arena& arena) { sampling.reserve(arena, limits_of(surface)); });
    ASSERT_TRUE(sampling.apply(surface).ok());
    EXPECT_EQ(surface.size, points);
  }
};

std::size_t with_normals(const Surface& surface) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < surface.size; ++i) count += surface.has_normal(i) ? 1 : 0;
  return count;
}

TEST_F(PclFront, CovarianceSamplingOfWallsHasTheListedConditions) {
  const CloudData cloud = load("sac_plane_test.pcd");
  if (cloud.size() == 0) GTEST_SKIP() << test::kNoRecordedData;
  test::OwnedSurface walls = test::surface_of(cloud);
  PcaNormalsParams params;
  params.radius_m = 0.05;
  params.min_neighbours = 3;
  estimate_normals(*walls, params);
  // PCL's own tolerances.
  EXPECT_NEAR(covariance_condition(*walls), 113.29773, 10.0);
  sample(*walls, with_normals(*walls) / 4);
  EXPECT_NEAR(covariance_condition(*walls), 22.11506, 2.0);
}

TEST_F(PclFront, CovarianceSamplingOfATurtleHasTheListedConditions) {
  const CloudData cloud = load("cturtle.pcd");
  if (cloud.size() == 0) GTEST_SKIP() << test::kNoRecordedData;
  test::OwnedSurface turtle = test::surface_of(cloud);
  PcaNormalsParams params;
  params.k = 5;
  params.min_neighbours = 3;
  estimate_normals(*turtle, params);
  EXPECT_NEAR(covariance_condition(*turtle), 102982728.6578, 2e4);
  sample(*turtle, with_normals(*turtle) / 8);
  EXPECT_NEAR(covariance_condition(*turtle), 15697094.2996, 5e3);
}

TEST_F(PclFront, VoxelsWithACovarianceAre23) {
  const CloudData cloud = load("bun0.pcd");
  if (cloud.size() == 0) GTEST_SKIP() << test::kNoRecordedData;
  test::OwnedSurface bunny = test::surface_of(cloud);
  VoxelCovarianceParams params;
  params.leaf_m = 0.02;
  VoxelCovariance filter(params);
  const test::ArenaMemory memory(
      [&](Arena& arena) { filter.reserve(arena, test::small_limits()); });
  ASSERT_TRUE(filter.apply(*bunny).ok());
  ASSERT_EQ(bunny->size, 23U);
  ASSERT_EQ(filter.covariances().size(), 23U);
  const auto expect_at = [&](std::size_t i, const Vec3f& place) {
    EXPECT_LT((bunny->point(i) - place).cwiseAbs().maxCoeff(), 1e-4F) << i;
  };
  expect_at(0, Vec3f(-0.073619894683361053F, 0.16789889335632324F, -0.03018110990524292F));
  expect_at(13, Vec3f(-0.06865914911031723F, 0.15243285894393921F, 0.03266800194978714F));
  // The cell nearest to a place, and those near the origin: PCL's searches among its cells.
  const auto nearest_to = [&](const Vec3f& place) {
    std::size_t best = 0;
    for (std::size_t i = 1; i < bunny->size; ++i) {
      if ((bunny->point(i) - place).norm() < (bunny->point(best) - place).norm()) best = i;
    }
    return best;
  };
  expect_at(nearest_to(Vec3f(0.0F, 1.0F, 0.0F)), Vec3f(-0.0284687F, 0.170919F, -0.00765753F));
  expect_at(nearest_to(Vec3f::Zero()), Vec3f(0.0322579F, 0.0469001F, 0.0328501F));
  std::size_t near = 0;
  for (std::size_t i = 0; i < bunny->size; ++i) near += bunny->point(i).norm() <= 0.075F ? 1 : 0;
  EXPECT_EQ(near, 3U);
}

TEST_F(PclFront, BoundariesOfTheBunnyAreTheListedOnes) {
  const CloudData cloud = load("bun0.pcd");
  if (cloud.size() == 0) GTEST_SKIP() << test::kNoRecordedData;
  test::OwnedSurface bunny = test::surface_of(cloud);
  PcaNormalsParams whole;
  whole.k = static_cast<int>(bunny->size);
  estimate_normals(*bunny, whole);
  BorderPointsParams params;
  params.radius_m = 10.0;  // PCL: as many neighbours as points
  BorderPoints borders(params);
  const test::ArenaMemory memory(
      [&](Arena& arena) { borders.reserve(arena, test::small_limits()); });
  const auto found = borders.find(*bunny);
  ASSERT_TRUE(found.ok());
  const std::size_t n = bunny->size;
  EXPECT_EQ(found.value()[0], 0);
  EXPECT_EQ(found.value()[n / 3], 0);
  EXPECT_EQ(found.value()[n / 2], 0);
  EXPECT_EQ(found.value()[n - 1], 1);
}

TEST_F(PclFront, CentroidAndCovarianceOfTheBunnyAreTheListedOnes) {
  const CloudData cloud = load("bun0.pcd");
  if (cloud.size() == 0) GTEST_SKIP() << test::kNoRecordedData;
  test::OwnedSurface bunny = test::surface_of(cloud);
  const Vec3d centre = centroid(*bunny);
  EXPECT_LT((centre - Vec3d(-0.0290809, 0.102653, 0.027302)).cwiseAbs().maxCoeff(), 1e-4);
  Symmetric3 sum;
  for (std::size_t i = 0; i < bunny->size; ++i) {
    const Vec3d d = bunny->point(i).cast<double>() - centre;
    sum.add(d.x(), d.y(), d.z());
  }
  EXPECT_NEAR(sum.xx, 0.710046, 1e-4);
  EXPECT_NEAR(sum.xy, -0.234843, 1e-4);
  EXPECT_NEAR(sum.xz, 0.0704933, 1e-4);
  EXPECT_NEAR(sum.yy, 0.68695, 1e-4);
  EXPECT_NEAR(sum.yz, -0.220504, 1e-4);
  EXPECT_NEAR(sum.zz, 0.195448, 1e-4);
}

/// Windows of one to four pixels at every place, as PCL's test goes over them.
template <class Check>
void for_windows(int width, int height, const Check& check) {
  for (int w = 1; w < 5; ++w) {
    for (int h = 1; h < 5; ++h) {
      for (int v = 0; v < height - h; ++v) {
        for (int u = 0; u < width - w; ++u) check(PixelWindow{u, v, w, h});
      }
    }
  }
}

TEST(PclIntegralImage, SumsAndCountsAreThoseByHand) {
  constexpr int kWidth = 640;
  constexpr int kHeight = 480;
  // Of a column's number, a row's, their sum, and the six products; odd columns without a value.
  for (const bool holes : {false, true}) {
    IntegralImage image;
    const test::ArenaMemory memory([&](Arena& arena) {
      image.reserve(arena, 9, static_cast<std::size_t>(kWidth) * kHeight, kWidth);
    });
    ASSERT_TRUE(image.fits(kWidth, kHeight));
    image.fill(kWidth, kHeight, [&](int u, int v, double* values) {
      if (holes && u % 2 == 1) return false;
      const double x = u;
      const double y = v;
      const double list[9] = {
          x, y, x + y, x * x, x * y, x * (x + y), y * y, y * (x + y), (x + y) * (x + y)};
      std::copy_n(list, 9, values);
      return true;
    });
    std::size_t wrong = 0;
    for_windows(kWidth, kHeight, [&](const PixelWindow& at) {
      double expected[9] = {};
      int count = 0;
      for (int u = at.u; u < at.u + at.width; ++u) {
        if (holes && u % 2 == 1) continue;
        count += at.height;
        // Sums of v and v² over the rows, in closed form.
        const double h = at.height;
        const double rows = h * (2.0 * at.v + h - 1.0) / 2.0;
        const auto squares = [](double n) { return n * (n + 1.0) * (2.0 * n + 1.0) / 6.0; };
        const double row_squares = squares(at.v + h - 1.0) - squares(at.v - 1.0);
        const double x = u;
        const double sums[9] = {h * x,
                                rows,
                                h * x + rows,
                                h * x * x,
                                x * rows,
                                h * x * x + x * rows,
                                row_squares,
                                x * rows + row_squares,
                                h * x * x + 2.0 * x * rows + row_squares};
        for (std::size_t c = 0; c < 9; ++c) expected[c] += sums[c];
      }
      wrong += image.count(at) != count ? 1 : 0;
      // Whole numbers below 2^53: exact.
      for (std::size_t c = 0; c < 9; ++c) wrong += image.sum(c, at) != expected[c] ? 1 : 0;
    });
    EXPECT_EQ(wrong, 0U) << (holes ? "with holes" : "full");
  }
}

class PclIntegralNormals : public testing::TestWithParam<IntegralNormalsParams::By> {};

// PCL's cloud: x and y are column and row, z = 10 m; the normal is (0, 0, ±1) to 1e-2.
TEST_P(PclIntegralNormals, OfAPlaneAreItsNormal) {
  constexpr int kWidth = 640;
  constexpr int kHeight = 480;
  constexpr std::size_t kPixels = static_cast<std::size_t>(kWidth) * kHeight;
  test::OwnedSurface plane(kPixels, kPixels);
  plane->size = kPixels;
  plane->grid.width = kWidth;
  plane->grid.height = kHeight;
  for (std::size_t i = 0; i < kPixels; ++i) {
    plane->x[i] = static_cast<float>(i % kWidth);
    plane->y[i] = static_cast<float>(i / kWidth);
    plane->z[i] = 10.0F;
    plane->grid.point_of[i] = plane->grid.pixel_of[i] = static_cast<std::int32_t>(i);
  }
  IntegralNormalsParams params;
  params.by = GetParam();
  IntegralNormals normals(params);
  const test::ArenaMemory memory([&](Arena& arena) { normals.reserve(arena, Limits{}); });
  ASSERT_TRUE(normals.estimate(*plane).ok());
  std::size_t found = 0;
  for (std::size_t i = 0; i < kPixels; ++i) {
    if (!plane->has_normal(i)) continue;
    ++found;
    ASSERT_NEAR(std::fabs(plane->nx[i]), 0.0F, 1e-2F) << i;
    ASSERT_NEAR(std::fabs(plane->ny[i]), 0.0F, 1e-2F) << i;
    ASSERT_NEAR(std::fabs(plane->nz[i]), 1.0F, 1e-2F) << i;
  }
  // All but the outermost pixels.
  EXPECT_EQ(found, static_cast<std::size_t>(kWidth - 2) * (kHeight - 2));
}

INSTANTIATE_TEST_SUITE_P(EveryWay, PclIntegralNormals,
                         testing::Values(IntegralNormalsParams::By::CovarianceMatrix,
                                         IntegralNormalsParams::By::Average3dGradient,
                                         IntegralNormalsParams::By::AverageDepthChange,
                                         IntegralNormalsParams::By::Simple3dGradient));

}  // namespace
}  // namespace grapnel
