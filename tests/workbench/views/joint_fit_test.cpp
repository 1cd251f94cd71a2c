#include "workbench/views/joint_fit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "base/rng.h"

namespace grapnel {
namespace {

constexpr Intrinsics kCamera = {320, 240, 400.0, 400.0, 159.5, 119.5};
const Vec3d kHalfAxes_m(0.10, 0.07, 0.05);
const Vec3d kMiddle(0.0, 0.0, 0.45);

/// The camera walks around an ellipsoid: world is view 0's frame.
Pose walk_around(double angle_rad) {
  Pose pose = Pose::Identity();
  pose.linear() = rotation_from_vector(Vec3d(0.15 * angle_rad, angle_rad, 0.0));
  pose.translation() = kMiddle - pose.linear() * kMiddle;
  return pose;
}

/// What a camera sees of the ellipsoid, by exact intersection of every pixel's ray.
std::vector<SurfaceSample> ellipsoid_samples(const Pose& world_from_view) {
  std::vector<SurfaceSample> samples;
  const Pose view_from_world = world_from_view.inverse();
  const Mat3d scale = kHalfAxes_m.cwiseInverse().asDiagonal();
  for (int v = 0; v < kCamera.height; ++v) {
    for (int u = 0; u < kCamera.width; ++u) {
      const Vec3d ray((u - kCamera.cx) / kCamera.fx, (v - kCamera.cy) / kCamera.fy, 1.0);
      const Vec3d d = scale * (world_from_view.linear() * ray);
      const Vec3d o = scale * (world_from_view.translation() - kMiddle);
      const double b = o.dot(d);
      const double root = b * b - d.squaredNorm() * (o.squaredNorm() - 1.0);
      if (root < 0.0) continue;
      const double z = (-b - std::sqrt(root)) / d.squaredNorm();
      const Vec3d p = z * ray;
      const Vec3d n = scale * (scale * (world_from_view * p - kMiddle));
      SurfaceSample sample;
      sample.point = p.cast<float>();
      sample.normal = (view_from_world.linear() * n.normalized()).cast<float>();
      sample.weight = 1.0F / (0.0003F * 0.0003F);
      if (sample.normal.dot(sample.point.normalized()) < -0.3F) samples.push_back(sample);
    }
  }
  return samples;
}

std::vector<JointView> walk(std::size_t count) {
  std::vector<JointView> views;
  for (std::size_t i = 0; i < count; ++i) {
    const Pose pose = walk_around(0.35 * static_cast<double>(i));
    views.push_back({ellipsoid_samples(pose), kCamera, pose});
  }
  return views;
}

void disturb(std::vector<JointView>& views) {
  Rng rng(2);
  for (std::size_t i = 1; i < views.size(); ++i) {
    Pose motion = Pose::Identity();
    motion.linear() = rotation_from_vector(
        0.01 * Vec3d(rng.uniform(-1.0, 1.0), rng.uniform(-1.0, 1.0), rng.uniform(-1.0, 1.0)));
    motion.translation() = kMiddle - motion.linear() * kMiddle + Vec3d(0.001, -0.001, 0.0005);
    views[i].world_from_view = views[i].world_from_view * motion;
  }
}

TEST(JointFit, BringsDisturbedViewsBackOntoEachOther) {
  std::vector<JointView> views = walk(6);
  disturb(views);
  JointFitOptions options;
  options.fit_focal = false;
  const JointFit fit = fit_together(views, options);
  ASSERT_GT(fit.partners, 1000U);
  EXPECT_EQ(fit.focal_factor, 1.0);
  for (std::size_t i = 0; i < views.size(); ++i) {
    const Pose error =
        walk_around(0.35 * static_cast<double>(i)).inverse() * fit.world_from_view[i];
    // Exact points on the chords of a curved surface: pixels are 1.1 mm apart.
    EXPECT_LT((error * kMiddle - kMiddle).norm(), 0.0003) << i;
    EXPECT_LT(rotation_angle_rad(error, Pose::Identity()), 0.003) << i;
  }
}

TEST(JointFit, LeavesARightFocalLengthAlone) {
  std::vector<JointView> views = walk(6);
  disturb(views);
  const JointFit fit = fit_together(views, {});
  EXPECT_NEAR(fit.focal_factor, 1.0, 0.002);
}

TEST(JointFit, FindsAFocalLengthThatIsWrongForAllViews) {
  constexpr double kWrong = 1.02;
  std::vector<JointView> views = walk(6);
  for (JointView& view : views) {
    // What the same readings give under focal lengths 2 % too long.
    apply_focal_factor(kWrong, view.samples);
    view.intrinsics.fx *= kWrong;
    view.intrinsics.fy *= kWrong;
  }
  const JointFit fit = fit_together(views, {});
  EXPECT_NEAR(fit.focal_factor, 1.0 / kWrong, 0.003);
  EXPECT_GT(std::abs(fit.focal_factor - 1.0), 3.0 * fit.focal_sigma);
  const Pose error = walk_around(1.75).inverse() * fit.world_from_view.back();
  EXPECT_LT(rotation_angle_rad(error, Pose::Identity()), 0.005);
}

}  // namespace
}  // namespace grapnel
