#include "pipeline/kernels/lay_discs.h"

#include <gtest/gtest.h>

#include <cstring>
#include <string>
#include <vector>

#include "base/rng.h"
#include "pipeline/kernels/target.h"

namespace grapnel {
namespace {

class LayDiscs : public testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { ASSERT_TRUE(kernels::force_target(GetParam())); }
  void TearDown() override { ASSERT_TRUE(kernels::force_target("")); }
};

INSTANTIATE_TEST_SUITE_P(OnEveryTarget, LayDiscs, testing::ValuesIn(kernels::target_names()),
                         [](const auto& target) { return target.param; });

/// Oriented points within 0.4 m of the origin, no more of them than said.
struct Cloud {
  std::vector<float> x, y, z, nx, ny, nz;
  void add(const Vec3f& p, const Vec3f& n) {
    x.push_back(p.x());
    y.push_back(p.y());
    z.push_back(p.z());
    nx.push_back(n.x());
    ny.push_back(n.y());
    nz.push_back(n.z());
  }
  [[nodiscard]] kernels::OrientedPlanes planes() const {
    return {x.data(), y.data(), z.data(), nx.data(), ny.data(), nz.data()};
  }
};

Cloud random_cloud(std::size_t count) {
  Rng rng(3);
  const auto random = [&](double reach) {
    return Vec3f(static_cast<float>(rng.uniform(-reach, reach)),
                 static_cast<float>(rng.uniform(-reach, reach)),
                 static_cast<float>(rng.uniform(-reach, reach)));
  };
  Cloud cloud;
  for (std::size_t i = 0; i < count; ++i) cloud.add(random(0.4), random(1.0).normalized());
  // No normal, and behind the camera after the shift below.
  cloud.add({0.1F, 0.0F, 0.0F}, {0.0F, 0.0F, 0.0F});
  cloud.add({0.0F, 0.0F, -3.0F}, {0.0F, 0.0F, -1.0F});
  return cloud;
}

kernels::Motion one_metre_ahead() {
  Pose pose = Pose::Identity();
  pose.linear() = Eigen::Quaterniond(0.9, 0.2, -0.3, 0.1).normalized().toRotationMatrix();
  pose.translation() = Vec3d(0.02, -0.05, 1.0);
  return kernels::motion_of(pose);
}

kernels::DiscLaw law() {
  kernels::DiscLaw law;
  law.fx = 271.0F;
  law.fy = 270.0F;
  law.cx = 80.0F;
  law.cy = 60.0F;
  law.radius_m = 0.006F;
  law.least_cosine_square = 0.03F;
  law.most_px = 2.0F;
  law.u0 = 5;
  law.v0 = 3;
  law.u1 = 150;
  law.v1 = 110;
  return law;
}

TEST_P(LayDiscs, GivesTheBitsOfThePlainLoop) {
  for (const std::size_t count : {0U, 5U, 254U}) {
    const Cloud cloud = random_cloud(count);
    const std::size_t size = cloud.x.size();
    std::vector<kernels::Disc> fast(size), plain(size);
    kernels::DiscBounds fast_bounds{150, 110, 5, 3};
    kernels::DiscBounds plain_bounds = fast_bounds;
    const std::size_t first = size > 20 ? 3 : 0;
    const std::size_t made = kernels::lay_discs(cloud.planes(), first, size - first,
                                                one_metre_ahead(), law(), fast.data(), fast_bounds);
    ASSERT_EQ(made,
              kernels::reference::lay_discs(cloud.planes(), first, size - first, one_metre_ahead(),
                                            law(), plain.data(), plain_bounds));
    EXPECT_EQ(std::memcmp(fast.data(), plain.data(), size * sizeof(kernels::Disc)), 0);
    EXPECT_EQ(std::memcmp(&fast_bounds, &plain_bounds, sizeof fast_bounds), 0);
    if (count == 254) {
      EXPECT_GT(made, 40U);
      EXPECT_LT(made, 200U);
    }
  }
}

TEST_P(LayDiscs, APointOnTheAxisThatFacesTheCameraIsADiscOfItsDepth) {
  Cloud cloud;
  cloud.add({0.0F, 0.0F, 2.0F}, {0.0F, 0.0F, -1.0F});
  cloud.add({0.0F, 0.0F, 2.0F}, {0.0F, 0.0F, 1.0F});
  std::vector<kernels::Disc> discs(2);
  kernels::DiscBounds bounds{150, 110, 5, 3};
  ASSERT_EQ(kernels::lay_discs(cloud.planes(), 0, 2, {}, law(), discs.data(), bounds), 1U);
  EXPECT_EQ(discs[0].point, 0);
  EXPECT_FLOAT_EQ(discs[0].start, 0.5F);
  EXPECT_FLOAT_EQ(discs[0].step_u, 0.0F);
  // 271 · 0.006 / 2 = 0.8 pixels around (80, 60).
  EXPECT_EQ(discs[0].u0, 79);
  EXPECT_EQ(discs[0].u1, 81);
  EXPECT_EQ(bounds.v0, 59);
  EXPECT_EQ(bounds.v1, 62);
}

}  // namespace
}  // namespace grapnel
