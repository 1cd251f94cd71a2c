#include "tests/pipeline/support/box_scene.h"

#include <algorithm>
#include <cmath>

#include "base/rng.h"

namespace grapnel::test {

CloudData box_cloud(const Vec3d& size_m, double spacing_m) {
  CloudData cloud;
  const Vec3d half = 0.5 * size_m;
  for (int axis = 0; axis < 3; ++axis) {
    const int a = (axis + 1) % 3;
    const int b = (axis + 2) % 3;
    const int steps_a = static_cast<int>(std::lround(size_m[a] / spacing_m));
    const int steps_b = static_cast<int>(std::lround(size_m[b] / spacing_m));
    for (const double side : {-1.0, 1.0}) {
      for (int i = 0; i <= steps_a; ++i) {
        for (int j = 0; j <= steps_b; ++j) {
          Vec3d p = Vec3d::Zero();
          p[axis] = side * half[axis];
          p[a] = -half[a] + size_m[a] * i / steps_a;
          p[b] = -half[b] + size_m[b] * j / steps_b;
          Vec3d n = Vec3d::Zero();
          n[axis] = side;
          cloud.x.push_back(static_cast<float>(p.x()));
          cloud.y.push_back(static_cast<float>(p.y()));
          cloud.z.push_back(static_cast<float>(p.z()));
          cloud.nx.push_back(static_cast<float>(n.x()));
          cloud.ny.push_back(static_cast<float>(n.y()));
          cloud.nz.push_back(static_cast<float>(n.z()));
        }
      }
    }
  }
  cloud.width = static_cast<int>(cloud.size());
  return cloud;
}

Model box_model(const Vec3d& size_m, double spacing_m) {
  Model model = model_from_cloud(box_cloud(size_m, spacing_m), "box");
  model.symmetry = Symmetry::Box;
  return model;
}

BoxScene::BoxScene(int width, int height, double focal_px, double belt_z_m)
    : frame_(width, height, focal_px) {
  frame_.frame.metres_per_unit = 0.0002;
  for (std::uint16_t& count : frame_.counts) {
    count = static_cast<std::uint16_t>(std::lround(belt_z_m / frame_.frame.metres_per_unit));
  }
}

void BoxScene::add(const Pose& camera_from_box, const Vec3d& size_m) {
  const Pose box_from_camera = camera_from_box.inverse();
  const Intrinsics& k = frame_.frame.intrinsics;
  for (int v = 0; v < k.height; ++v) {
    for (int u = 0; u < k.width; ++u) {
      const Vec3d ray((u - k.cx) / k.fx, (v - k.cy) / k.fy, 1.0);
      const Vec3d direction = box_from_camera.linear() * ray;
      const Vec3d origin = box_from_camera.translation();
      double enter = 0.0;
      double leave = 1e9;
      for (int axis = 0; axis < 3; ++axis) {
        const double near = (-0.5 * size_m[axis] - origin[axis]) / direction[axis];
        const double far = (0.5 * size_m[axis] - origin[axis]) / direction[axis];
        enter = std::max(enter, std::min(near, far));
        leave = std::min(leave, std::max(near, far));
      }
      if (enter >= leave) continue;
      const auto count =
          static_cast<std::uint16_t>(std::lround(enter / frame_.frame.metres_per_unit));
      std::uint16_t& pixel = frame_.at(u, v);
      if (pixel == 0 || count < pixel) pixel = count;
    }
  }
}

void BoxScene::add_noise(std::uint64_t seed) {
  Rng rng(seed);
  const double unit = frame_.frame.metres_per_unit;
  for (std::uint16_t& count : frame_.counts) {
    const double z = count * unit;
    count = static_cast<std::uint16_t>(std::lround((z + 1.425e-3 * z * z * rng.normal()) / unit));
  }
}

Pose lying(const Vec3d& size_m, double belt_z_m, double x_m, double y_m, double yaw_rad) {
  Pose pose = Pose::Identity();
  Mat3d down;
  down << 1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, -1.0;
  pose.linear() = rotation_from_vector(Vec3d(0.0, 0.0, yaw_rad)) * down;
  pose.translation() = Vec3d(x_m, y_m, belt_z_m - 0.5 * size_m.z());
  return pose;
}

}  // namespace grapnel::test
