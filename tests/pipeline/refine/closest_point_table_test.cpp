#include "pipeline/refine/closest_point_table.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "base/rng.h"
#include "pipeline/kernels/target.h"
#include "tests/pipeline/support/surfaces.h"

namespace grapnel {
namespace {

float brute_force(const Surface& surface, const Vec3f& p) {
  float best = std::numeric_limits<float>::max();
  for (std::size_t i = 0; i < surface.size; ++i) {
    best = std::min(best, (surface.point(i) - p).norm());
  }
  return best;
}

TEST(ClosestPointTable, FindsThePointThatASearchFindsOrOneAsNear) {
  test::OwnedSurface ball = test::bumpy_ball(3000, 0.1);
  ClosestPointTable table;
  const test::ArenaMemory memory([&](Arena& arena) { table.reserve(arena, 500000); });
  table.build(*ball, 0.03);
  Rng rng(7);
  for (int i = 0; i < 3000; ++i) {
    const auto k = rng.below(static_cast<std::uint32_t>(ball->size));
    const Vec3f p = ball->point(k) + 0.02F * Vec3f(static_cast<float>(rng.normal()),
                                                   static_cast<float>(rng.normal()),
                                                   static_cast<float>(rng.normal()));
    const std::int32_t found = table.closest(p, 1.0F);
    if (found < 0) continue;  // outside of the grid
    const float distance = (ball->point(static_cast<std::size_t>(found)) - p).norm();
    // Candidates belong to voxel centres; a nearer point may hide by half a voxel's diagonal.
    EXPECT_LT(distance - brute_force(*ball, p), 0.9F * static_cast<float>(table.voxel_m()));
  }
}

TEST(ClosestPointTable, FindsEveryPointItself) {
  test::OwnedSurface ball = test::bumpy_ball(2000, 0.1);
  ClosestPointTable table;
  const test::ArenaMemory memory([&](Arena& arena) { table.reserve(arena, 500000); });
  table.build(*ball, 0.01);
  std::size_t exact = 0;
  for (std::size_t i = 0; i < ball->size; ++i) {
    const std::int32_t found = table.closest(ball->point(i), 0.01F);
    ASSERT_GE(found, 0);
    exact += static_cast<std::size_t>(found) == i ? 1U : 0U;
  }
  // Points that share a voxel hide each other.
  EXPECT_GT(exact, 95 * ball->size / 100);
}

TEST(ClosestPointTable, RespectsItsDistanceAndItsEdges) {
  test::OwnedSurface ball = test::sphere(500, 0.1, true);
  ClosestPointTable table;
  const test::ArenaMemory memory([&](Arena& arena) { table.reserve(arena, 50000); });
  table.build(*ball, 0.05);
  EXPECT_EQ(table.closest(Vec3f::Zero(), 0.05F), -1);
  EXPECT_GE(table.closest(Vec3f::Zero(), 0.12F), 0);
  EXPECT_EQ(table.closest(Vec3f(9.0F, 0.0F, 0.0F), 100.0F), -1);
  EXPECT_EQ(table.nearby(Vec3f(0.0F, -9.0F, 0.0F)), -1);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(table.closest(Vec3f(nan, 0.0F, 0.0F), 1.0F), -1);
}

TEST(ClosestPointTable, FindsWithinItsReachWhatASearchFindsOrOneAsNear) {
  test::OwnedSurface ball = test::bumpy_ball(3000, 0.1);
  for (const double reach_m : {0.01, 0.03}) {
    ClosestPointTable table;
    const test::ArenaMemory memory([&](Arena& arena) { table.reserve(arena, 250000); });
    table.build_within(*ball, reach_m);
    Rng rng(7);
    std::size_t found_any = 0;
    for (int i = 0; i < 3000; ++i) {
      const auto k = rng.below(static_cast<std::uint32_t>(ball->size));
      const Vec3f p = ball->point(k) + 0.02F * Vec3f(static_cast<float>(rng.normal()),
                                                     static_cast<float>(rng.normal()),
                                                     static_cast<float>(rng.normal()));
      const float nearest = brute_force(*ball, p);
      const std::int32_t found = table.closest(p, static_cast<float>(reach_m));
      // Candidates belong to voxel centres; a nearer point may hide by half a voxel's diagonal.
      const float slack = 0.9F * static_cast<float>(table.voxel_m());
      if (nearest > static_cast<float>(reach_m)) {
        EXPECT_EQ(found, -1);
      } else if (nearest < static_cast<float>(reach_m) - slack) {
        ASSERT_GE(found, 0);
      }
      if (found < 0) continue;
      ++found_any;
      EXPECT_LT((ball->point(static_cast<std::size_t>(found)) - p).norm() - nearest, slack);
    }
    EXPECT_GT(found_any, 900U);
  }
}

TEST(ClosestPointTable, FindsForManyPointsWhatItFindsForEach) {
  test::OwnedSurface ball = test::bumpy_ball(1500, 0.2);
  ClosestPointTable table;
  const test::ArenaMemory memory([&](Arena& arena) { table.reserve(arena, 60000); });
  table.build(*ball, 0.05);
  Rng rng(41);
  constexpr std::size_t kCount = 1003;
  std::array<std::vector<float>, 3> p;
  for (std::vector<float>& plane : p) {
    plane.resize(kernels::in_lanes(kCount));
    for (float& value : plane) value = static_cast<float>(rng.uniform(-0.35, 0.35));
  }
  for (const std::string& target : kernels::target_names()) {
    ASSERT_TRUE(kernels::force_target(target));
    std::vector<std::int32_t> found(kernels::in_lanes(kCount));
    table.closest_of_each(p[0].data(), p[1].data(), p[2].data(), kCount, 0.06F, found.data());
    std::size_t partners = 0;
    for (std::size_t i = 0; i < kCount; ++i) {
      ASSERT_EQ(found[i], table.closest(Vec3f(p[0][i], p[1][i], p[2][i]), 0.06F)) << i;
      partners += found[i] >= 0 ? 1U : 0U;
    }
    EXPECT_GT(partners, kCount / 10);
  }
  ASSERT_TRUE(kernels::force_target(""));
}

}  // namespace
}  // namespace grapnel
