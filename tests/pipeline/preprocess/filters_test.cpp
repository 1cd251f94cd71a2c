#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <vector>

#include "base/rng.h"
#include "pipeline/kernels/target.h"
#include "pipeline/neighbours/cell_order.h"
#include "pipeline/preprocess/clusters.h"
#include "pipeline/preprocess/crop.h"
#include "pipeline/preprocess/flying_points.h"
#include "pipeline/preprocess/grid_stride.h"
#include "pipeline/preprocess/normal_space.h"
#include "pipeline/preprocess/plane_normals.h"
#include "pipeline/preprocess/radius_outliers.h"
#include "pipeline/preprocess/random_sample.h"
#include "pipeline/preprocess/statistical_outliers.h"
#include "pipeline/preprocess/temporal_median.h"
#include "pipeline/preprocess/uniform_sample.h"
#include "pipeline/preprocess/z_median.h"
#include "tests/pipeline/support/surfaces.h"

namespace grapnel {
namespace {

template <class Filter>
struct Reserved {
  Filter filter;
  test::ArenaMemory memory;
  template <class Params>
  explicit Reserved(const Params& params)
      : filter(params),
        memory([&](Arena& arena) { filter.reserve(arena, test::small_limits()); }) {}
};

/// Mean distance to the k nearest others, by looking at all.
std::vector<double> mean_distances(const Surface& surface, std::size_t k) {
  std::vector<double> means;
  for (std::size_t i = 0; i < surface.size; ++i) {
    std::vector<double> squares;
    for (std::size_t j = 0; j < surface.size; ++j) {
      if (j != i) squares.push_back((surface.point(j) - surface.point(i)).cast<double>().norm());
    }
    std::partial_sort(squares.begin(), squares.begin() + static_cast<std::ptrdiff_t>(k),
                      squares.end());
    double sum = 0.0;
    for (std::size_t n = 0; n < k; ++n) sum += squares[n];
    means.push_back(sum / static_cast<double>(k));
  }
  return means;
}

void expect_brute_force_means(Surface& surface, int k, Engine engine) {
  const std::vector<double> expected = mean_distances(surface, static_cast<std::size_t>(k));
  StatisticalOutlierParams params;
  params.k = k;
  params.std_mul = 100.0;
  params.engine = engine;
  Reserved<StatisticalOutliers> s(params);
  const Result<std::size_t> removed = s.filter.apply(surface);
  ASSERT_TRUE(removed.ok());
  EXPECT_EQ(removed.value(), 0U);
  for (std::size_t i = 0; i < expected.size(); ++i) {
    // Single precision of coordinates near 1 m, and of twenty square roots.
    ASSERT_NEAR(static_cast<double>(s.filter.mean_distance_m()[i]), expected[i],
                1e-6 + 2e-6 * expected[i])
        << i;
  }
}

TEST(StatisticalOutliers, MeanDistancesEqualBruteForceOnAGrid) {
  for (const std::string& target : kernels::target_names()) {
    ASSERT_TRUE(kernels::force_target(target));
    for (const int k : {1, 8, 20, 60}) {
      test::OwnedSurface grid = test::wavy_grid(61, 43, 5);
      expect_brute_force_means(*grid, k, Engine::Fast);
    }
  }
  ASSERT_TRUE(kernels::force_target(""));
}

TEST(StatisticalOutliers, MeanDistancesEqualBruteForceOnACloud) {
  test::OwnedSurface cloud = test::random_cloud(1200, 0.5, 6);
  expect_brute_force_means(*cloud, 20, Engine::Fast);
  test::OwnedSurface again = test::random_cloud(1200, 0.5, 6);
  expect_brute_force_means(*again, 20, Engine::Reference);
}

TEST(StatisticalOutliers, TakeALonePointAway) {
  test::OwnedSurface cloud = test::random_cloud(1000, 0.2, 7);
  cloud->x[500] = 2.0F;
  Reserved<StatisticalOutliers> s(StatisticalOutlierParams{20, 5.0, Engine::Fast});
  const Result<std::size_t> removed = s.filter.apply(*cloud);
  ASSERT_TRUE(removed.ok());
  EXPECT_EQ(removed.value(), 1U);
  for (std::size_t i = 0; i < cloud->size; ++i) EXPECT_LT(cloud->x[i], 1.0F);
}

TEST(RadiusOutliers, KeepPointsWithEnoughOthersAsBruteForceDoes) {
  test::OwnedSurface cloud = test::random_cloud(1500, 0.5, 8);
  RadiusOutlierParams params;
  params.radius_m = 0.05;
  params.min_neighbours = 6;
  std::size_t expected = 0;
  for (std::size_t i = 0; i < cloud->size; ++i) {
    int near = -1;
    for (std::size_t j = 0; j < cloud->size; ++j) {
      near += (cloud->point(j) - cloud->point(i)).squaredNorm() <= 0.05F * 0.05F ? 1 : 0;
    }
    expected += near >= 6 ? 1U : 0U;
  }
  Reserved<RadiusOutliers> r(params);
  ASSERT_TRUE(r.filter.apply(*cloud).ok());
  EXPECT_EQ(cloud->size, expected);
  EXPECT_GT(expected, 100U);
  EXPECT_LT(expected, 1400U);
}

TEST(UniformSample, LeavesThePointNearestToEachCellsCentre) {
  test::OwnedSurface cloud = test::random_cloud(3000, 0.3, 9);
  using Cell = std::array<int, 3>;
  std::vector<std::pair<Cell, float>> all;
  const float per_m = static_cast<float>(1.0 / 0.05);
  const auto cell_of = [&](const Vec3f& p) {
    return Cell{static_cast<int>(std::floor(p.x() * per_m)),
                static_cast<int>(std::floor(p.y() * per_m)),
                static_cast<int>(std::floor(p.z() * per_m))};
  };
  const auto off = [&](const Vec3f& p) {
    const Vec3f place = p * per_m;
    return (place - Vec3f(place.array().floor() + 0.5F)).squaredNorm();
  };
  std::set<Cell> cells;
  for (std::size_t i = 0; i < cloud->size; ++i) {
    cells.insert(cell_of(cloud->point(i)));
    all.emplace_back(cell_of(cloud->point(i)), off(cloud->point(i)));
  }
  UniformSampleParams params;
  params.cell_m = 0.05;
  Reserved<UniformSample> u(params);
  ASSERT_TRUE(u.filter.apply(*cloud).ok());
  ASSERT_EQ(cloud->size, cells.size());
  for (std::size_t i = 0; i < cloud->size; ++i) {
    const Cell cell = cell_of(cloud->point(i));
    for (const auto& [other, distance] : all) {
      if (other == cell) {
        EXPECT_LE(off(cloud->point(i)), distance);
      }
    }
  }
}

TEST(RandomSample, LeavesTheNumberAskedForAndIsFair) {
  std::vector<int> chosen(200, 0);
  for (int seed = 0; seed < 400; ++seed) {
    test::OwnedSurface cloud = test::random_cloud(200, 1.0, 10);
    for (std::size_t i = 0; i < 200; ++i) cloud->intensity[i] = static_cast<float>(i);
    Reserved<RandomSample> r(RandomSampleParams{50, seed});
    ASSERT_TRUE(r.filter.apply(*cloud).ok());
    ASSERT_EQ(cloud->size, 50U);
    for (std::size_t i = 0; i < 50; ++i) ++chosen[static_cast<std::size_t>(cloud->intensity[i])];
  }
  // 100 expected, standard deviation 8.7: six of them.
  for (const int count : chosen) EXPECT_NEAR(count, 100, 52);
}

TEST(NormalSpaceSample, GivesAFewPointsOfAnEdgeTheirShare) {
  // 900 points face the camera, 60 face sideways.
  test::OwnedSurface cloud = test::random_cloud(960, 0.5, 11);
  for (std::size_t i = 0; i < 960; ++i) {
    cloud->nx[i] = i < 60 ? 1.0F : 0.0F;
    cloud->nz[i] = i < 60 ? 0.0F : -1.0F;
  }
  Reserved<NormalSpaceSample> n(NormalSpaceParams{100, 1});
  ASSERT_TRUE(n.filter.apply(*cloud).ok());
  ASSERT_EQ(cloud->size, 100U);
  std::size_t sideways = 0;
  for (std::size_t i = 0; i < 100; ++i) sideways += cloud->nx[i] > 0.5F ? 1U : 0U;
  EXPECT_EQ(sideways, 50U);
}

TEST(Crop, KeepsTheBoxOrWhatLiesOutside) {
  test::OwnedSurface cloud = test::random_cloud(2000, 1.0, 12);
  test::OwnedSurface other = test::random_cloud(2000, 1.0, 12);
  CropParams params;
  params.min_x_m = 0.1;
  params.max_x_m = 0.4;
  Reserved<Crop> in(params);
  params.inside = false;
  Reserved<Crop> out(params);
  ASSERT_TRUE(in.filter.apply(*cloud).ok());
  ASSERT_TRUE(out.filter.apply(*other).ok());
  EXPECT_EQ(cloud->size + other->size, 2000U);
  EXPECT_GT(cloud->size, 400U);
  for (std::size_t i = 0; i < cloud->size; ++i) {
    EXPECT_GE(cloud->x[i], 0.1F);
    EXPECT_LE(cloud->x[i], 0.4F);
  }
}

TEST(Clusters, KeepTheLargestOfThreeBalls) {
  test::OwnedSurface cloud = test::random_cloud(900, 0.1, 13);
  for (std::size_t i = 0; i < 900; ++i) {
    cloud->x[i] += i < 200 ? 1.0F : (i < 600 ? 2.0F : 3.0F);
  }
  ClusterParams params;
  params.distance_m = 0.05;
  Reserved<Clusters> c(params);
  ASSERT_TRUE(c.filter.apply(*cloud).ok());
  EXPECT_EQ(c.filter.found(), 3U);
  ASSERT_EQ(cloud->size, 400U);
  for (std::size_t i = 0; i < 400; ++i) EXPECT_NEAR(cloud->x[i], 2.05F, 0.06F);
}

TEST(ZMedian, TakesASpikeAwayAndKeepsTheRay) {
  test::OwnedSurface grid = test::wavy_grid(40, 30, 14);
  const std::size_t spike = grid->size / 2;
  const Vec3f before = grid->point(spike);
  for (std::span<float>* plane : {&grid->x, &grid->y, &grid->z}) (*plane)[spike] *= 1.3F;
  Reserved<ZMedian> m(ZMedianParams{});
  ASSERT_TRUE(m.filter.apply(*grid).ok());
  // The sheet's waves move it by less than 5 mm over two pixels.
  EXPECT_NEAR(grid->z[spike], before.z(), 0.01F);
  EXPECT_NEAR(grid->x[spike] / grid->z[spike], before.x() / before.z(), 1e-5F);
}

TEST(FlyingPoints, GoFromBetweenTwoSurfaces) {
  test::OwnedSurface grid = test::wavy_grid(40, 30, 15);
  const std::size_t flying = grid->size / 2;
  for (std::span<float>* plane : {&grid->x, &grid->y, &grid->z}) (*plane)[flying] *= 0.8F;
  const float z = grid->z[flying];
  const std::size_t before = grid->size;
  Reserved<FlyingPoints> f(FlyingPointParams{});
  ASSERT_TRUE(f.filter.apply(*grid).ok());
  EXPECT_LT(grid->size, before);
  for (std::size_t i = 0; i < grid->size; ++i) EXPECT_NE(grid->z[i], z);
}

TEST(GridStride, LeavesAPointOfEachBlockOnAGridOfBlocks) {
  test::OwnedSurface grid = test::wavy_grid(60, 45, 16);
  Reserved<GridStride> s(GridStrideParams{3});
  ASSERT_TRUE(s.filter.apply(*grid).ok());
  EXPECT_EQ(grid->grid.width, 20);
  EXPECT_EQ(grid->grid.height, 15);
  const Intrinsics& k = grid->grid.intrinsics;
  for (std::size_t i = 0; i < grid->size; ++i) {
    const int pixel = grid->grid.pixel_of[i];
    ASSERT_EQ(grid->grid.point_of[static_cast<std::size_t>(pixel)], static_cast<int>(i));
    const double u = k.fx * static_cast<double>(grid->x[i] / grid->z[i]) + k.cx;
    const double v = k.fy * static_cast<double>(grid->y[i] / grid->z[i]) + k.cy;
    // Anywhere in its block, and float.
    EXPECT_NEAR(u, pixel % 20, 0.5);
    EXPECT_NEAR(v, pixel / 20, 0.5);
  }
}

// A cell's edge: cells few for the points, as many, and so many that bits stand for 64, 64² or 64³.
TEST(CellOrder, NumbersCellsInLinearOrderAndSortsTheirPoints) {
  constexpr std::size_t kPoints = 5000;
  CellOrder order;
  const test::ArenaMemory memory([&](Arena& arena) { order.reserve(arena, kPoints); });
  for (const double edge : {3.0, 0.07, 0.015, 0.004, 0.001, 0.00026}) {
    for (const std::size_t points : {kPoints, std::size_t{64}, std::size_t{1}}) {
      test::OwnedSurface cloud = test::random_cloud(points, 1.0, 17);
      for (float& x : cloud->x.first(points)) x -= 0.5F;
      const auto cell = [&](std::size_t i) {
        const Vec3f place = cloud->point(i) * static_cast<float>(1.0 / edge);
        return std::array{std::floor(place.z()), std::floor(place.y()), std::floor(place.x())};
      };
      std::map<std::array<float, 3>, std::vector<std::uint64_t>> expected;
      for (std::size_t i = 0; i < points; ++i) expected[cell(i)].push_back(i);
      ASSERT_TRUE(order.sort(*cloud, edge));
      ASSERT_EQ(order.cells(), expected.size());
      std::size_t number = 0;
      for (const auto& [place, inside] : expected) {
        ASSERT_TRUE(std::ranges::equal(order.points_of(number), inside)) << edge << " " << number;
        for (const std::uint64_t i : inside) ASSERT_EQ(order.cell_of()[i], number);
        ++number;
      }
    }
  }
  test::OwnedSurface cloud = test::random_cloud(kPoints, 1.0, 17);
  EXPECT_FALSE(order.number(*cloud, 1e-8));
}

TEST(PlaneNormals, AreThoseOfAPlaneAndTheSameOnEveryTarget) {
  test::TestFrame frame(64, 48, 60.0);
  const Vec3d normal = Vec3d(0.3, -0.4, -1.0).normalized();
  std::vector<Vec3f> first;
  for (const std::string& target : kernels::target_names()) {
    ASSERT_TRUE(kernels::force_target(target));
    test::OwnedSurface grid(64 * 48, 64 * 48);
    grid->grid.width = 64;
    grid->grid.height = 48;
    grid->grid.intrinsics = frame.frame.intrinsics;
    const Intrinsics& k = grid->grid.intrinsics;
    for (int v = 0; v < 48; ++v) {
      for (int u = 0; u < 64; ++u) {
        const auto i = grid->size++;
        const Vec3d ray((u - k.cx) / k.fx, (v - k.cy) / k.fy, 1.0);
        const double z = -1.2 / normal.dot(ray);
        grid->x[i] = static_cast<float>(z * ray.x());
        grid->y[i] = static_cast<float>(z * ray.y());
        grid->z[i] = static_cast<float>(z);
        grid->grid.point_of[i] = grid->grid.pixel_of[i] = static_cast<std::int32_t>(i);
      }
    }
    Reserved<PlaneNormals> n(PlaneNormalsParams{0.5});
    ASSERT_TRUE(n.filter.estimate(*grid).ok());
    std::size_t with_normal = 0;
    std::vector<Vec3f> normals;
    for (std::size_t i = 0; i < grid->size; ++i) {
      normals.push_back(grid->normal(i));
      if (!grid->has_normal(i)) continue;
      ++with_normal;
      // Float inverse depths, right to 6e-8, over five pixels of 1/60 rad.
      ASSERT_LT((grid->normal(i).cast<double>() - normal).norm(), 2e-5) << i;
    }
    EXPECT_EQ(with_normal, 60U * 44U) << "all but a rim of two pixels";
    if (first.empty()) first = normals;
    EXPECT_EQ(first, normals) << target;
  }
  ASSERT_TRUE(kernels::force_target(""));
}

TEST(PlaneNormals, AreAbsentAcrossAStep) {
  test::OwnedSurface grid = test::wavy_grid(60, 40, 19);
  for (std::size_t i = 0; i < grid->size; ++i) {
    if (grid->grid.pixel_of[i] % 60 < 30) continue;
    for (std::span<float>* plane : {&grid->x, &grid->y, &grid->z}) (*plane)[i] *= 1.5F;
  }
  Reserved<PlaneNormals> n(PlaneNormalsParams{});
  ASSERT_TRUE(n.filter.estimate(*grid).ok());
  for (std::size_t i = 0; i < grid->size; ++i) {
    const int u = grid->grid.pixel_of[i] % 60;
    if (u >= 28 && u < 32) {
      EXPECT_FALSE(grid->has_normal(i)) << u;
    }
  }
}

TEST(TemporalMedian, IsThatOfTheReadingsOfEachPixel) {
  constexpr int kWidth = 13;
  constexpr int kHeight = 7;
  TemporalMedian median;
  const test::ArenaMemory memory([&](Arena& arena) { median.reserve(arena, kWidth * kHeight, 5); });
  Rng rng(18);
  std::vector<std::vector<std::uint16_t>> frames;
  std::vector<std::uint16_t> out(kWidth * kHeight);
  EXPECT_FALSE(median.median({out.data(), kWidth, kHeight}).ok());
  for (std::size_t pushed = 1; pushed <= 8; ++pushed) {
    frames.emplace_back(kWidth * kHeight);
    for (std::uint16_t& value : frames.back()) {
      value = rng.uniform() < 0.4 ? 0 : static_cast<std::uint16_t>(500 + rng.below(1000));
    }
    ASSERT_TRUE(median.push({frames.back().data(), kWidth, kHeight}).ok());
    ASSERT_TRUE(median.median({out.data(), kWidth, kHeight}).ok());
    EXPECT_EQ(median.held(), std::min<std::size_t>(pushed, 5));
    for (std::size_t pixel = 0; pixel < out.size(); ++pixel) {
      std::vector<std::uint16_t> read;
      for (std::size_t f = frames.size() - median.held(); f < frames.size(); ++f) {
        if (frames[f][pixel] != 0) read.push_back(frames[f][pixel]);
      }
      std::sort(read.begin(), read.end());
      ASSERT_EQ(out[pixel], read.empty() ? 0 : read[read.size() / 2]) << pushed << " " << pixel;
    }
  }
}

}  // namespace
}  // namespace grapnel
