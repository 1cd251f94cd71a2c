#include "workbench/teach/fusion.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "base/geometry.h"

namespace grapnel {
namespace {

constexpr Intrinsics kCamera = {160, 120, 150.0, 150.0, 79.5, 59.5};
constexpr double kUnit_m = 0.0001;

/// Depth of the plane n·p = d, counts.
std::vector<std::uint16_t> plane_depth(const Vec3d& normal, double distance_m) {
  std::vector<std::uint16_t> depth;
  for (int v = 0; v < kCamera.height; ++v) {
    for (int u = 0; u < kCamera.width; ++u) {
      const Vec3d ray((u - kCamera.cx) / kCamera.fx, (v - kCamera.cy) / kCamera.fy, 1.0);
      const double z_m = distance_m / normal.dot(ray);
      depth.push_back(static_cast<std::uint16_t>(std::lround(z_m / kUnit_m)));
    }
  }
  return depth;
}

DepthFrame frame_of(const std::vector<std::uint16_t>& depth) {
  DepthFrame frame;
  frame.depth = {depth.data(), kCamera.width, kCamera.height};
  frame.metres_per_unit = kUnit_m;
  frame.intrinsics = kCamera;
  return frame;
}

TEST(FrameSamples, OfATiltedPlaneHaveItsNormalTowardTheCamera) {
  const Vec3d away = Vec3d(0.3, -0.2, 1.0).normalized();
  const std::vector<std::uint16_t> depth = plane_depth(away, 0.8);
  const std::vector<SurfaceSample> samples = frame_samples(frame_of(depth), {});
  ASSERT_GT(samples.size(), 15000U);
  for (const SurfaceSample& sample : samples) {
    // Depth steps of 0.1 mm over a window of 37 mm tilt a plane by far less than a degree.
    EXPECT_GT(sample.normal.dot(-away.cast<float>()), std::cos(0.0087F));
  }
}

TEST(FrameSamples, LeaveOutBlackMaskPixels) {
  const std::vector<std::uint16_t> depth = plane_depth(Vec3d::UnitZ(), 0.8);
  std::vector<Rgb8> mask(depth.size());
  for (int v = 0; v < kCamera.height; ++v) {
    for (int u = 80; u < kCamera.width; ++u) {
      mask[static_cast<std::size_t>(v * kCamera.width + u)] = {255, 255, 255};
    }
  }
  const ImageView<const Rgb8> view{mask.data(), kCamera.width, kCamera.height};
  const std::vector<SurfaceSample> samples = frame_samples(frame_of(depth), view);
  ASSERT_FALSE(samples.empty());
  for (const SurfaceSample& sample : samples) EXPECT_GT(sample.point.x(), 0.0F);
}

TEST(FrameSamples, LeaveOutTheRimOfAStep) {
  std::vector<std::uint16_t> depth = plane_depth(Vec3d::UnitZ(), 0.8);
  for (int v = 0; v < kCamera.height; ++v) {
    for (int u = 0; u < 80; ++u) depth[static_cast<std::size_t>(v * kCamera.width + u)] = 5000;
  }
  for (const SurfaceSample& sample : frame_samples(frame_of(depth), {})) {
    const double u = sample.point.x() / sample.point.z() * kCamera.fx + kCamera.cx;
    EXPECT_GE(std::abs(u - 79.5), 0.99);
  }
}

SurfaceSample sample_at(const Vec3f& point, const Vec3f& normal, float weight) {
  SurfaceSample sample;
  sample.point = point;
  sample.normal = normal;
  sample.weight = weight;
  return sample;
}

TEST(Fusion, WeighsSamplesOfAVoxelByTheirPrecision) {
  Fusion fusion(0.01, {});
  const std::vector<SurfaceSample> first = {sample_at({0.001F, 0.0F, 0.0F}, Vec3f::UnitZ(), 3.0F)};
  const std::vector<SurfaceSample> second = {sample_at({0.005F, 0.0F, 0.0F}, Vec3f::UnitZ(), 1.0F)};
  fusion.add(first, Pose::Identity());
  fusion.add(second, Pose::Identity());
  const CloudData cloud = fusion.cloud(2);
  ASSERT_EQ(cloud.size(), 1U);
  EXPECT_NEAR(cloud.x[0], 0.002F, 1e-7F);
}

TEST(Fusion, CountsAViewOnceHoweverManySamplesItGives) {
  Fusion fusion(0.01, {});
  const std::vector<SurfaceSample> samples(5,
                                           sample_at({0.001F, 0.0F, 0.0F}, Vec3f::UnitZ(), 1.0F));
  fusion.add(samples, Pose::Identity());
  EXPECT_EQ(fusion.cloud(1).size(), 1U);
  EXPECT_EQ(fusion.cloud(2).size(), 0U);
}

TEST(Fusion, KeepsTheTwoSidesOfAThinWallApart) {
  Fusion fusion(0.01, {});
  const std::vector<SurfaceSample> samples = {
      sample_at({0.001F, 0.001F, 0.001F}, Vec3f::UnitZ(), 1.0F),
      sample_at({0.001F, 0.001F, 0.000F}, Vec3f(-Vec3f::UnitZ()), 1.0F)};
  fusion.add(samples, Pose::Identity());
  EXPECT_EQ(fusion.cloud(1).size(), 2U);
}

TEST(Fusion, CarriesPointsAndNormalsByThePoseAndCutsTheBox) {
  Box box;
  box.low = Vec3d(0.9, -1.0, -1.0);
  box.high = Vec3d(1.1, 1.0, 1.0);
  Fusion fusion(0.01, box);
  Pose pose = Pose::Identity();
  pose.linear() = rotation_from_vector(Vec3d(0.0, 1.5707963267948966, 0.0));  // z becomes x
  const std::vector<SurfaceSample> samples = {sample_at({0.0F, 0.0F, 1.0F}, Vec3f::UnitZ(), 1.0F),
                                              sample_at({0.0F, 0.0F, 2.0F}, Vec3f::UnitZ(), 1.0F)};
  fusion.add(samples, pose);
  const CloudData cloud = fusion.cloud(1);
  ASSERT_EQ(cloud.size(), 1U);
  EXPECT_NEAR(cloud.x[0], 1.0F, 1e-6F);
  EXPECT_NEAR(cloud.nx[0], 1.0F, 1e-6F);
}

}  // namespace
}  // namespace grapnel
