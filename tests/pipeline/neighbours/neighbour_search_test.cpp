#include "pipeline/neighbours/neighbour_search.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "base/rng.h"
#include "pipeline/kernels/target.h"
#include "pipeline/neighbours/symmetric3.h"
#include "tests/pipeline/support/surfaces.h"

namespace grapnel {
namespace {

struct Search {
  NeighbourSearch search;
  test::ArenaMemory memory;
  explicit Search(std::size_t max_points = 8000, std::size_t max_grid = 32000)
      : memory([&](Arena& arena) { search.reserve(arena, max_points, max_grid); }) {}
};

std::vector<std::int32_t> brute_force(const Surface& surface, const Vec3f& place, float radius) {
  std::vector<std::int32_t> found;
  for (std::size_t i = 0; i < surface.size; ++i) {
    const float dx = surface.x[i] - place.x();
    const float dy = surface.y[i] - place.y();
    const float dz = surface.z[i] - place.z();
    if ((dx * dx + dy * dy) + dz * dz <= radius * radius) {
      found.push_back(static_cast<std::int32_t>(i));
    }
  }
  return found;
}

std::vector<std::int32_t> sorted(const Neighbourhood& found) {
  std::vector<std::int32_t> list(found.index.begin(), found.index.end());
  std::sort(list.begin(), list.end());
  return list;
}

void expect_brute_force(NeighbourSearch& search, const Surface& surface, float radius) {
  for (std::size_t i = 0; i < surface.size; i += 1 + surface.size / 200) {
    ASSERT_EQ(sorted(search.within(i, radius)), brute_force(surface, surface.point(i), radius))
        << "point " << i << " radius " << radius;
  }
}

TEST(NeighbourSearch, EqualsBruteForceInARandomCloud) {
  test::OwnedSurface cloud = test::random_cloud(1500, 1.0, 1);
  Search s;
  ASSERT_TRUE(s.search.build(*cloud, 0.1).ok());
  EXPECT_FALSE(s.search.uses_grid());
  for (const float radius : {0.0F, 0.03F, 0.1F, 0.35F, 3.0F}) {
    expect_brute_force(s.search, *cloud, radius);
  }
}

TEST(NeighbourSearch, EqualsBruteForceOnAGrid) {
  test::OwnedSurface grid = test::wavy_grid(60, 50, 2);
  Search s;
  ASSERT_TRUE(s.search.build(*grid, 0.05).ok());
  EXPECT_TRUE(s.search.uses_grid());
  for (const float radius : {0.0F, 0.02F, 0.05F, 0.3F, 2.0F}) {
    expect_brute_force(s.search, *grid, radius);
  }
}

TEST(NeighbourSearch, EqualsBruteForceAroundAnyPlace) {
  test::OwnedSurface grid = test::wavy_grid(60, 50, 3);
  test::OwnedSurface cloud = test::random_cloud(800, 1.0, 4);
  Rng rng(5);
  for (Surface* surface : {&*grid, &*cloud}) {
    Search s;
    ASSERT_TRUE(s.search.build(*surface, 0.1).ok());
    for (int i = 0; i < 300; ++i) {
      const Vec3f place(static_cast<float>(rng.uniform(-1.0, 2.0)),
                        static_cast<float>(rng.uniform(-1.0, 2.0)),
                        static_cast<float>(rng.uniform(-1.0, 2.5)));
      const auto radius = static_cast<float>(rng.uniform(0.0, 0.8));
      ASSERT_EQ(sorted(s.search.within(place, radius)), brute_force(*surface, place, radius));
    }
  }
}

TEST(NeighbourSearch, GivesGridNeighboursInAscendingOrder) {
  test::OwnedSurface grid = test::wavy_grid(60, 50, 6);
  Search s;
  ASSERT_TRUE(s.search.build(*grid, 0.05).ok());
  const Neighbourhood found = s.search.within(grid->size / 2, 0.1F);
  EXPECT_GT(found.size(), 20U);
  EXPECT_TRUE(std::is_sorted(found.index.begin(), found.index.end()));
}

TEST(NeighbourSearch, TakesAMovedGridForACloud) {
  test::OwnedSurface grid = test::wavy_grid(60, 50, 7);
  for (std::size_t i = 0; i < grid->size; ++i) grid->x[i] += 0.3F;
  Search s;
  ASSERT_TRUE(s.search.build(*grid, 0.05).ok());
  EXPECT_FALSE(s.search.uses_grid());
  expect_brute_force(s.search, *grid, 0.05F);
}

TEST(NeighbourSearch, FindsTheNearestInOrderOfDistance) {
  test::OwnedSurface grid = test::wavy_grid(40, 30, 8);
  test::OwnedSurface cloud = test::random_cloud(700, 1.0, 9);
  for (Surface* surface : {&*grid, &*cloud}) {
    Search s;
    ASSERT_TRUE(s.search.build(*surface, 0.01).ok());
    for (std::size_t i = 0; i < surface->size; i += 37) {
      std::vector<std::pair<float, std::int32_t>> all;
      for (std::size_t j = 0; j < surface->size; ++j) {
        const Vec3f d = surface->point(j) - surface->point(i);
        const float squared = (d.x() * d.x() + d.y() * d.y()) + d.z() * d.z();
        all.emplace_back(squared, static_cast<std::int32_t>(j));
      }
      std::sort(all.begin(), all.end());
      const Neighbourhood found = s.search.nearest(surface->point(i), 12);
      ASSERT_EQ(found.size(), 12U);
      for (std::size_t k = 0; k < 12; ++k) {
        ASSERT_EQ(found.index[k], all[k].second);
        ASSERT_EQ(found.squared_m2[k], all[k].first);
      }
    }
    EXPECT_EQ(s.search.nearest(surface->point(0), 100000).size(), surface->size);
  }
}

TEST(NeighbourSearch, FindsWhatIsNearABlockAsNearEachOfItsPoints) {
  test::OwnedSurface grid = test::wavy_grid(60, 50, 12);
  test::OwnedSurface cloud = test::random_cloud(1500, 1.0, 13);
  std::vector<std::int32_t> position(grid->size + cloud->size);
  std::vector<float> squared_m2(position.size() * kernels::kBlock);
  kernels::NearBlock near;
  near.position = position;
  near.squared_m2 = squared_m2;
  for (Surface* surface : {&*grid, &*cloud}) {
    Search s;
    ASSERT_TRUE(s.search.build(*surface, 0.1).ok());
    EXPECT_EQ(s.search.uses_grid(), surface == &*grid);
    // The largest one looks into more rows of cells than are handed on at once.
    for (const float radius : {0.0F, 0.03F, 0.1F, 0.5F}) {
      for (std::size_t first = 0; first < surface->size;) {
        const kernels::BlockOfPoints block = s.search.block_from(first, radius);
        ASSERT_TRUE(s.search.near_block(block, radius, near));
        for (std::size_t lane = 0; lane < static_cast<std::size_t>(block.count); ++lane) {
          std::vector<std::int32_t> found;
          for (std::size_t i = 0; i < near.size; ++i) {
            if (squared_m2[i * kernels::kBlock + lane] != kernels::kOutside) {
              found.push_back(position[i]);
            }
          }
          const Neighbourhood alone = s.search.near_position(first + lane, radius);
          ASSERT_EQ(found, std::vector(alone.index.begin(), alone.index.end()));
          ASSERT_EQ(static_cast<std::size_t>(near.of[lane]), found.size());
        }
        first += static_cast<std::size_t>(block.count);
      }
    }
  }
}

TEST(NeighbourSearch, SumsASphereInABlockAsBruteForce) {
  test::OwnedSurface cloud = test::random_cloud(1500, 1.0, 11);
  Search s;
  ASSERT_TRUE(s.search.build(*cloud, 0.1).ok());
  // The largest one looks into more rows of cells than are handed on at once.
  for (const float radius : {0.0F, 0.03F, 0.1F, 0.5F}) {
    std::vector<int> seen(cloud->size, 0);
    for (std::size_t position = 0; position < cloud->size;) {
      const kernels::BlockOfPoints block = s.search.block_from(position, radius);
      float sums[kernels::kWindowSums][kernels::kBlock];
      s.search.block_moments(block, radius, sums);
      for (std::size_t lane = 0; lane < static_cast<std::size_t>(block.count); ++lane) {
        const std::size_t i = s.search.point_at(position + lane);
        ++seen[i];
        const std::vector<std::int32_t> around = brute_force(*cloud, cloud->point(i), radius);
        Vec3d sum = Vec3d::Zero();
        double xy = 0.0;
        for (const std::int32_t other : around) {
          const Vec3d d =
              (cloud->point(static_cast<std::size_t>(other)) - cloud->point(i)).cast<double>();
          sum += d;
          xy += d.x() * d.y();
        }
        ASSERT_EQ(static_cast<std::size_t>(sums[0][lane]), around.size());
        // Floats, by the sum of the sizes of what is added.
        const auto size = static_cast<double>(around.size());
        ASSERT_NEAR(static_cast<double>(sums[1][lane]), sum.x(), 1e-6 * radius * size);
        ASSERT_NEAR(static_cast<double>(sums[3][lane]), sum.z(), 1e-6 * radius * size);
        ASSERT_NEAR(static_cast<double>(sums[5][lane]), xy, 1e-6 * radius * radius * size);
      }
      position += static_cast<std::size_t>(block.count);
    }
    EXPECT_EQ(seen, std::vector<int>(cloud->size, 1));
  }
}

TEST(NeighbourSearch, HandlesDegenerateClouds) {
  Search s;
  test::OwnedSurface empty(4, 0);
  EXPECT_EQ(s.search.build(*empty, 0.1).error().code, Code::TooFewPoints);
  test::OwnedSurface one = test::random_cloud(1, 1.0, 10);
  ASSERT_TRUE(s.search.build(*one, 0.1).ok());
  EXPECT_EQ(s.search.within(0, 0.1F).size(), 1U);
  EXPECT_EQ(s.search.nearest(Vec3f(50.0F, 0.0F, 0.0F), 3).size(), 1U);
  test::OwnedSurface same(100, 0);
  same->size = 100;
  ASSERT_TRUE(s.search.build(*same, 0.1).ok());
  EXPECT_EQ(s.search.within(7, 0.0F).size(), 100U);
  test::OwnedSurface far = test::random_cloud(500, 1.0, 11);
  far->x[3] = 1e6F;  // one outlier must not cost the memory of a thousand kilometres of cells
  ASSERT_TRUE(s.search.build(*far, 0.01).ok());
  expect_brute_force(s.search, *far, 0.2F);
  test::OwnedSurface many = test::random_cloud(9000, 1.0, 12);
  EXPECT_EQ(s.search.build(*many, 0.1).error().code, Code::CapacityExceeded);
}

TEST(NeighbourSearch, ThinsAListEvenly) {
  test::OwnedSurface cloud = test::random_cloud(1000, 1.0, 13);
  Search s;
  ASSERT_TRUE(s.search.build(*cloud, 0.5).ok());
  const std::vector<std::int32_t> all = [&] {
    const Neighbourhood found = s.search.within(0, 2.0F);
    return std::vector<std::int32_t>(found.index.begin(), found.index.end());
  }();
  ASSERT_EQ(all.size(), 1000U);
  const Neighbourhood thinned = s.search.thin(s.search.within(0, 2.0F), 100);
  ASSERT_EQ(thinned.size(), 100U);
  for (std::size_t k = 0; k < 100; ++k) EXPECT_EQ(thinned.index[k], all[10 * k]);
  EXPECT_EQ(s.search.thin(s.search.within(0, 2.0F), 5000).size(), 1000U);
}

TEST(NeighbourSearch, MeasuresTheSpacingOfALattice) {
  test::OwnedSurface lattice(400, 0);
  for (std::size_t i = 0; i < 400; ++i) {
    lattice->x[i] = 0.01F * static_cast<float>(i % 20);
    lattice->y[i] = 0.01F * static_cast<float>(i / 20);
  }
  lattice->size = 400;
  Search s;
  ASSERT_TRUE(s.search.build(*lattice, 0.1).ok());
  EXPECT_NEAR(mean_spacing_m(s.search, *lattice, 50), 0.01, 1e-8);
}

TEST(NeighbourSearch, UsesExactlyTheMeasuredMemory) {
  const Search s;
  EXPECT_EQ(s.memory.measured_bytes(), s.memory.used_bytes());
}

TEST(Symmetric3, EigenvaluesAndVectorsRebuildTheMatrix) {
  Rng rng(20);
  for (int trial = 0; trial < 2000; ++trial) {
    Symmetric3 m;
    const int rank = 1 + trial % 4;
    for (int i = 0; i < rank; ++i) m.add(rng.normal(), rng.normal(), 0.01 * rng.normal());
    const Eigen3 e = eigen_symmetric3(m);
    Mat3d full;
    full << m.xx, m.xy, m.xz, m.xy, m.yy, m.yz, m.xz, m.yz, m.zz;
    const double scale = full.norm();
    const Mat3d rebuilt = e.vectors * e.values.asDiagonal() * e.vectors.transpose();
    ASSERT_LT((rebuilt - full).norm(), 1e-13 * scale);
    ASSERT_LT((e.vectors.transpose() * e.vectors - Mat3d::Identity()).norm(), 1e-13);
    ASSERT_LE(e.values[0], e.values[1]);
    ASSERT_LE(e.values[1], e.values[2]);
  }
  EXPECT_EQ(eigen_symmetric3(Symmetric3{}).values, Vec3d(Vec3d::Zero()));
}

TEST(Symmetric3, ClosedFormAgreesWithTheRotations) {
  Rng rng(21);
  for (int trial = 0; trial < 5000; ++trial) {
    // Flat, thin, round and stretched neighbourhoods, in any direction.
    const double flat = trial % 3 == 0 ? 1e-4 : 0.3;
    const double thin = trial % 5 == 0 ? 1.0 : 0.2;
    const Mat3d turn = rotation_from_vector({rng.normal(), rng.normal(), rng.normal()});
    Symmetric3 m;
    for (int i = 0; i < 10; ++i) {
      const Vec3d d = turn * Vec3d(rng.normal(), thin * rng.normal(), flat * rng.normal());
      m.add(d.x(), d.y(), d.z());
    }
    const Eigen3 e = eigen_symmetric3(m);
    const Vec3d values = eigenvalues_symmetric3(m);
    const double gap = (e.values[1] - e.values[0]) / e.values[2];
    ASSERT_NEAR(values[0], e.values[0], std::min(1e-7, 1e-14 / gap) * e.values[2]);
    ASSERT_NEAR(values[1], e.values[1], 1e-7 * e.values[2]);
    ASSERT_NEAR(values[2], e.values[2], 1e-7 * e.values[2]);
    const Vec3d normal = smallest_eigenvector(m, values);
    ASSERT_NEAR(normal.norm(), 1.0, 1e-14);
    // Rounding over the gap to the next eigenvalue.
    ASSERT_LT(normal.cross(e.vectors.col(0)).norm(), 1e-13 / gap);
  }
  EXPECT_EQ(eigenvalues_symmetric3(Symmetric3{}), Vec3d(Vec3d::Zero()));
}

}  // namespace
}  // namespace grapnel
