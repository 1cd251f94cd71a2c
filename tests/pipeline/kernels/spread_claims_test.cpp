#include "pipeline/kernels/spread_claims.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "base/rng.h"
#include "pipeline/kernels/target.h"

namespace grapnel {
namespace {

using kernels::Claim;

class SpreadClaims : public testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { ASSERT_TRUE(kernels::force_target(GetParam())); }
  void TearDown() override { ASSERT_TRUE(kernels::force_target("")); }
};

INSTANTIATE_TEST_SUITE_P(OnEveryTarget, SpreadClaims, testing::ValuesIn(kernels::target_names()),
                         [](const auto& target) { return target.param; });

struct Seed {
  std::int32_t at[3];
  Claim own;
};

std::vector<Seed> seeds_in(const std::int32_t (&size)[3], Rng& rng) {
  std::vector<Seed> seeds(25);
  for (std::size_t i = 0; i < seeds.size(); ++i) {
    for (int axis = 0; axis < 3; ++axis) {
      seeds[i].at[axis] =
          static_cast<std::int32_t>(rng.below(static_cast<std::uint32_t>(size[axis])));
    }
    seeds[i].own = static_cast<Claim>(rng.below(12)) << 16 | static_cast<Claim>(i);
  }
  return seeds;
}

/// Of all seeds whose steps along every axis are within reach, the nearest.
Claim brute_force(const std::vector<Seed>& seeds, const std::int32_t (&at)[3], int reach) {
  Claim least = kernels::kUnclaimed;
  for (const Seed& seed : seeds) {
    Claim claim = seed.own;
    bool near = true;
    for (int axis = 0; axis < 3; ++axis) {
      const int step = at[axis] - seed.at[axis];
      near = near && step <= reach && -step <= reach;
      claim += static_cast<Claim>(step * step) * kernels::kClaimUnit;
    }
    if (near) least = std::min(least, claim);
  }
  return least;
}

TEST_P(SpreadClaims, GivesEachVoxelItsNearestSeedWithinReach) {
  Rng rng(5);
  for (const int reach : {1, 4, kernels::kMaxClaimReach}) {
    for (const int side : {1, 7, 16, 33}) {
      const std::int32_t size[3] = {side, 19, 38 - side};
      const std::vector<Seed> seeds = seeds_in(size, rng);
      std::vector<Claim> claims(
          static_cast<std::size_t>(size[0] * size[1] * size[2]) + kernels::kClaimSlack,
          kernels::kUnclaimed);
      for (const Seed& seed : seeds) {
        Claim& claim = claims[static_cast<std::size_t>(
            (seed.at[2] * size[1] + seed.at[1]) * size[0] + seed.at[0])];
        claim = std::min(claim, seed.own);
      }
      for (int axis = 0; axis < 3; ++axis) {
        kernels::spread_claims(axis, size, reach, claims.data());
      }
      std::size_t voxel = 0;
      for (std::int32_t z = 0; z < size[2]; ++z) {
        for (std::int32_t y = 0; y < size[1]; ++y) {
          for (std::int32_t x = 0; x < size[0]; ++x, ++voxel) {
            ASSERT_EQ(std::min(claims[voxel], kernels::kUnclaimed),
                      brute_force(seeds, {x, y, z}, reach))
                << x << " " << y << " " << z << " of " << side << " within " << reach;
          }
        }
      }
    }
  }
}

TEST_P(SpreadClaims, LeavesABoxWithoutSeedsUnclaimed) {
  const std::int32_t size[3] = {5, 6, 7};
  std::vector<Claim> claims(5 * 6 * 7 + kernels::kClaimSlack, kernels::kUnclaimed);
  for (int axis = 0; axis < 3; ++axis) kernels::spread_claims(axis, size, 9, claims.data());
  EXPECT_EQ(std::count(claims.begin(), claims.begin() + 5 * 6 * 7, kernels::kUnclaimed), 5 * 6 * 7);
}

}  // namespace
}  // namespace grapnel
