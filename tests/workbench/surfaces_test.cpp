#include "workbench/surfaces.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

namespace grapnel {
namespace {

constexpr Intrinsics kCamera = {64, 48, 60.0, 61.0, 31.2, 23.9};

/// A sphere's front as a camera at the origin sees it; NaN beside it.
CloudData organised_cloud() {
  CloudData cloud;
  cloud.width = kCamera.width;
  cloud.height = kCamera.height;
  for (int v = 0; v < kCamera.height; ++v) {
    for (int u = 0; u < kCamera.width; ++u) {
      const Vec3d ray((u - kCamera.cx) / kCamera.fx, (v - kCamera.cy) / kCamera.fy, 1.0);
      const double b = ray.z();
      const double root = b * b - ray.squaredNorm() * (1.0 - 0.16);  // centre (0,0,1), radius 0.4
      const double z = root > 0.0 ? (b - std::sqrt(root)) / ray.squaredNorm()
                                  : std::numeric_limits<double>::quiet_NaN();
      cloud.x.push_back(static_cast<float>(ray.x() * z));
      cloud.y.push_back(static_cast<float>(ray.y() * z));
      cloud.z.push_back(static_cast<float>(z));
    }
  }
  return cloud;
}

TEST(FitIntrinsics, FindsTheCameraOfAnOrganisedCloud) {
  const Intrinsics fitted = fit_intrinsics(organised_cloud());
  ASSERT_TRUE(fitted.valid());
  EXPECT_NEAR(fitted.fx, kCamera.fx, 1e-3);  // float coordinates: 6e-8 of 30 px
  EXPECT_NEAR(fitted.fy, kCamera.fy, 1e-3);
  EXPECT_NEAR(fitted.cx, kCamera.cx, 1e-3);
  EXPECT_NEAR(fitted.cy, kCamera.cy, 1e-3);
}

TEST(FitIntrinsics, RefusesAGridThatIsNoCameras) {
  CloudData cloud = organised_cloud();
  for (std::size_t i = 0; i < cloud.size(); ++i) cloud.x[i] += 0.3F * cloud.y[i] * cloud.y[i];
  EXPECT_FALSE(fit_intrinsics(cloud).valid());
  cloud.width = static_cast<int>(cloud.size());
  cloud.height = 1;
  EXPECT_FALSE(fit_intrinsics(cloud).valid());
}

TEST(MakeSurface, KeepsTheGridOfACamerasCloud) {
  const CloudData cloud = organised_cloud();
  const auto stored = make_surface(cloud);
  const Surface& surface = stored->surface;
  ASSERT_TRUE(surface.organised());
  EXPECT_TRUE(surface.has_viewpoint);
  EXPECT_GT(surface.size, 500U);
  EXPECT_LT(surface.size, cloud.size());
  for (std::size_t i = 0; i < surface.size; ++i) {
    const auto pixel = static_cast<std::size_t>(surface.grid.pixel_of[i]);
    EXPECT_EQ(surface.grid.point_of[pixel], static_cast<std::int32_t>(i));
    EXPECT_EQ(surface.z[i], cloud.z[pixel]);
  }
}

TEST(MakeSurface, OfAFrameProjectsBackOntoItsPixels) {
  std::vector<std::uint16_t> depth(static_cast<std::size_t>(kCamera.width * kCamera.height), 0);
  depth[5 * 64 + 7] = 1500;
  DepthFrame frame;
  frame.depth = {depth.data(), kCamera.width, kCamera.height};
  frame.intrinsics = kCamera;
  const auto stored = make_surface(frame);
  ASSERT_EQ(stored->surface.size, 1U);
  const Vec3f p = stored->surface.point(0);
  EXPECT_NEAR(p.x() / p.z() * kCamera.fx + kCamera.cx, 7.0, 1e-5);
  EXPECT_NEAR(p.y() / p.z() * kCamera.fy + kCamera.cy, 5.0, 1e-5);
  EXPECT_FLOAT_EQ(p.z(), 1.5F);
  EXPECT_EQ(stored->surface.grid.point_of[5 * 64 + 7], 0);
}

TEST(MakeSurface, LeavesOutPointsWithoutReadingAndScalesNormals) {
  CloudData cloud;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  cloud.x = {0.1F, nan, 0.3F};
  cloud.y = {0.1F, nan, 0.3F};
  cloud.z = {0.1F, nan, 0.3F};
  cloud.nx = {0.0F, 0.0F, 0.0F};
  cloud.ny = {0.0F, 0.0F, 0.0F};
  cloud.nz = {2.0F, 1.0F, 0.0F};
  cloud.width = 3;
  const auto stored = make_surface(cloud);
  ASSERT_EQ(stored->surface.size, 2U);
  EXPECT_FALSE(stored->surface.organised());
  EXPECT_FLOAT_EQ(stored->surface.nz[0], 1.0F);
  EXPECT_FALSE(stored->surface.has_normal(1));
}

/// A lattice of points about `middle`, 0.4 m wide and deep.
CloudData block_about(const Vec3f& middle) {
  CloudData cloud;
  for (int i = 0; i < 125; ++i) {
    cloud.x.push_back(middle.x() + 0.1F * static_cast<float>(i % 5 - 2));
    cloud.y.push_back(middle.y() + 0.1F * static_cast<float>(i / 5 % 5 - 2));
    cloud.z.push_back(middle.z() + 0.1F * static_cast<float>(i / 25 - 2));
  }
  cloud.width = 125;
  return cloud;
}

TEST(MakeSurface, TakesTheOriginForTheCameraOfACloudThatLiesBeforeIt) {
  const auto stored = make_surface(block_about({0.0F, 0.0F, 1.5F}));
  ASSERT_TRUE(stored->surface.has_viewpoint);
  EXPECT_TRUE(stored->surface.viewpoint.isZero());
}

TEST(MakeSurface, KnowsNoViewpointOfACloudAroundBesideOrBehindTheOrigin) {
  EXPECT_FALSE(make_surface(block_about({0.0F, 0.0F, 0.0F}))->surface.has_viewpoint);
  EXPECT_FALSE(make_surface(block_about({0.0F, 0.0F, 0.21F}))->surface.has_viewpoint);
  EXPECT_FALSE(make_surface(block_about({2.5F, 0.0F, 1.0F}))->surface.has_viewpoint);
  EXPECT_FALSE(make_surface(block_about({0.0F, 0.0F, -1.5F}))->surface.has_viewpoint);
}

TEST(MakeSurface, TakesTheViewpointThatTheFileNames) {
  CloudData cloud = block_about({0.0F, 0.0F, 0.0F});
  cloud.world_from_sensor.translation() = Vec3d(0.0, -2.0, 0.5);
  const auto stored = make_surface(cloud);
  ASSERT_TRUE(stored->surface.has_viewpoint);
  EXPECT_FLOAT_EQ(stored->surface.viewpoint.y(), -2.0F);
}

TEST(MeasuredSpacing, OfALatticeIsItsStep) {
  CloudData cloud;
  for (int i = 0; i < 900; ++i) {
    cloud.x.push_back(0.02F * static_cast<float>(i % 30));
    cloud.y.push_back(0.02F * static_cast<float>(i / 30));
    cloud.z.push_back(0.0F);
  }
  cloud.width = 900;
  EXPECT_NEAR(measured_spacing_m(make_surface(cloud)->surface), 0.02, 1e-6);
}

TEST(MeasuredSpacing, OfAGridIsThePixelPitchAtItsDepth) {
  const std::vector<std::uint16_t> depth(static_cast<std::size_t>(kCamera.width * kCamera.height),
                                         1200);
  DepthFrame frame;
  frame.depth = {depth.data(), kCamera.width, kCamera.height};
  frame.intrinsics = kCamera;
  EXPECT_NEAR(measured_spacing_m(make_surface(frame)->surface), 1.2 / kCamera.fx, 1e-6);
}

}  // namespace
}  // namespace grapnel
