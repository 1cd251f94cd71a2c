#include <gtest/gtest.h>

#include <array>
#include <cstring>
#include <limits>
#include <vector>

#include "base/rng.h"
#include "pipeline/kernels/pose_rating.h"
#include "pipeline/kernels/reference.h"
#include "pipeline/kernels/surface_pairs.h"
#include "pipeline/kernels/target.h"

namespace grapnel {
namespace {

/// Every test runs on each target that this machine has, and must give the same bits as the plain
/// loops of reference.h.
class PoseKernel : public testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { ASSERT_TRUE(kernels::force_target(GetParam())); }
  void TearDown() override { ASSERT_TRUE(kernels::force_target("")); }
};

INSTANTIATE_TEST_SUITE_P(OnEveryTarget, PoseKernel, testing::ValuesIn(kernels::target_names()),
                         [](const auto& target) { return target.param; });

float between(Rng& rng, double low, double high) {
  return static_cast<float>(low + (high - low) * rng.uniform());
}

/// Points in a cube of 0.4 m around (0, 0, 1) with unit normals, every ninth without one. Behind
/// them lies what the kernels may read: no numbers.
struct Cloud {
  std::array<std::vector<float>, 6> planes;
  Cloud(std::size_t count, Rng& rng) {
    for (std::size_t i = 0; i < count; ++i) {
      Vec3d n(rng.uniform() - 0.5, rng.uniform() - 0.5, rng.uniform() - 0.8);
      n = i % 9 == 8 ? Vec3d::Zero() : Vec3d(n.normalized());
      for (std::size_t k = 0; k < 3; ++k) {
        planes[k].push_back(between(rng, -0.2, 0.2) + (k == 2 ? 1.0F : 0.0F));
        planes[k + 3].push_back(static_cast<float>(n[static_cast<Eigen::Index>(k)]));
      }
    }
    for (std::vector<float>& plane : planes) {
      plane.resize(kernels::in_lanes(count), std::numeric_limits<float>::quiet_NaN());
    }
  }
  [[nodiscard]] kernels::OrientedPlanes view() const {
    return {planes[0].data(), planes[1].data(), planes[2].data(),
            planes[3].data(), planes[4].data(), planes[5].data()};
  }
};

kernels::Motion some_motion(Rng& rng) {
  Pose pose = Pose::Identity();
  pose.linear() = rotation_from_vector(Vec3d(rng.uniform(), rng.uniform() - 0.5, 0.3));
  pose.translation() = Vec3d(0.03, -0.02, 0.1 * rng.uniform());
  return kernels::motion_of(pose);
}

kernels::PointBlock block_of(const Cloud& cloud, std::size_t count, std::size_t partners,
                             Rng& rng) {
  kernels::PointBlock block{};
  block.size = count;
  float* const planes[6] = {block.x, block.y, block.z, block.nx, block.ny, block.nz};
  for (std::size_t k = 0; k < 6; ++k) {
    std::copy_n(cloud.planes[k].begin(), count, planes[k]);
  }
  for (std::size_t i = 0; i < kernels::kBlockPoints; ++i) {
    const bool none = i >= count || rng.uniform() < 0.2;
    block.partner[i] =
        none ? -1 : static_cast<std::int32_t>(rng.below(static_cast<std::uint32_t>(partners)));
  }
  return block;
}

TEST_P(PoseKernel, MovesPointsAsPlainLoopsDo) {
  Rng rng(1);
  for (const std::size_t count : {1U, 8U, 13U, 128U}) {
    const Cloud cloud(count, rng);
    const kernels::Motion motion = some_motion(rng);
    kernels::PointBlock block = block_of(cloud, count, 5, rng);
    kernels::PointBlock expected = block;
    kernels::move_block(motion, block);
    kernels::reference::move_block(motion, expected);
    EXPECT_EQ(std::memcmp(&block, &expected, sizeof(block)), 0) << count;
  }
}

TEST_P(PoseKernel, SumsOfPairsHaveTheSameBitsAsPlainLoops) {
  Rng rng(2);
  const Cloud fixed(300, rng);
  for (const std::size_t count : {1U, 7U, 64U, 128U}) {
    const Cloud cloud(count, rng);
    const kernels::PointBlock block = block_of(cloud, count, 300, rng);
    for (const bool symmetric : {false, true}) {
      const kernels::PairGate gate{0.04F, 0.01F, 0.2F, {0.01F, 0.02F, 1.0F}, symmetric};
      kernels::PlaneSums planes{};
      kernels::PlaneSums expected{};
      kernels::add_plane_pairs(block, fixed.view(), gate, planes);
      kernels::reference::add_plane_pairs(block, fixed.view(), gate, expected);
      EXPECT_EQ(std::memcmp(&planes, &expected, sizeof(planes)), 0) << count;
      kernels::PointSums points{};
      kernels::PointSums expected_points{};
      kernels::add_point_pairs(block, fixed.view(), gate, points);
      kernels::reference::add_point_pairs(block, fixed.view(), gate, expected_points);
      EXPECT_EQ(std::memcmp(&points, &expected_points, sizeof(points)), 0) << count;
    }
  }
}

TEST_P(PoseKernel, RatingsHaveTheSameBitsAsPlainLoops) {
  Rng rng(3);
  constexpr int kWidth = 61;
  constexpr int kHeight = 47;
  std::vector<float> depth(kWidth * kHeight);
  for (float& z : depth) {
    z = rng.uniform() < 0.2 ? 0.0F : between(rng, 0.8, 1.2);
    if (rng.below(2) == 0) z = -z;
  }
  const kernels::VoxelShape voxels{{-0.2F, -0.2F, 0.8F}, 40.0F, {16, 15, 14}};
  const Cloud surface(200, rng);
  std::vector<std::uint16_t> named(16 * 15 * 14);
  std::vector<std::uint8_t> level(named.size());
  for (std::size_t k = 0; k < named.size(); ++k) {
    named[k] = static_cast<std::uint16_t>(rng.below(200));
    level[k] = static_cast<std::uint8_t>(rng.below(33));
  }
  std::vector<float> worth(33);
  for (float& value : worth) value = between(rng, 0.0, 1.0);
  for (const std::size_t count : {1U, 8U, 63U, 65U, 384U}) {
    const Cloud samples(count, rng);
    const kernels::Motion motion = some_motion(rng);
    const kernels::SignedDepth pixels{depth.data(), kWidth, kHeight, 90.0F, 91.0F, 30.5F, 23.5F};
    const kernels::SightLaw law{0.1F, 0.17F, 0.3F, 0.4F, 2.0F};
    const kernels::Sight sight = kernels::rate_sight(samples.view(), count, motion, pixels, law);
    const kernels::Sight expected =
        kernels::reference::rate_sight(samples.view(), count, motion, pixels, law);
    EXPECT_EQ(sight.facing, expected.facing);
    EXPECT_EQ(sight.worth, expected.worth);
    const kernels::NamedSurface target{voxels, named.data(), surface.view()};
    EXPECT_EQ(
        kernels::rate_on_surface(samples.view(), count, motion, target, 0.2F, 0.3F),
        kernels::reference::rate_on_surface(samples.view(), count, motion, target, 0.2F, 0.3F));
    const kernels::LevelField field{voxels, level.data(), worth.data()};
    EXPECT_EQ(kernels::rate_in_field(samples.view(), count, motion, field),
              kernels::reference::rate_in_field(samples.view(), count, motion, field));
    std::vector<std::int32_t> voxel(kernels::in_lanes(count));
    std::vector<std::int32_t> expected_voxel(voxel.size());
    const kernels::OrientedPlanes p = samples.view();
    kernels::find_voxels(voxels, p.x, p.y, p.z, count, voxel.data());
    kernels::reference::find_voxels(voxels, p.x, p.y, p.z, count, expected_voxel.data());
    voxel.resize(count);
    expected_voxel.resize(count);
    EXPECT_EQ(voxel, expected_voxel);
  }
}

}  // namespace
}  // namespace grapnel
