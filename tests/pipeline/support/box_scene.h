#pragma once

#include <cstdint>

#include "base/cloud.h"
#include "base/geometry.h"
#include "pipeline/model.h"
#include "tests/pipeline/support/surfaces.h"

namespace grapnel::test {

/// Points and outward normals of a box around the origin, every `spacing_m`.
[[nodiscard]] CloudData box_cloud(const Vec3d& size_m, double spacing_m);
/// The same as a model with a box's symmetry.
[[nodiscard]] Model box_model(const Vec3d& size_m, double spacing_m);

/// A camera looking down on a plane at `belt_z_m`, by ray casting. Noise as of a Kinect (sigma =
/// 1.425e-3 z²), independent from pixel to pixel; seed 0 = none.
class BoxScene {
 public:
  BoxScene(int width, int height, double focal_px, double belt_z_m);

  /// Adds a box; nearer surface wins.
  void add(const Pose& camera_from_box, const Vec3d& size_m);
  void add_noise(std::uint64_t seed);
  [[nodiscard]] const DepthFrame& frame() const { return frame_.frame; }
  TestFrame& pixels() { return frame_; }

 private:
  TestFrame frame_;
};

/// A box lying on the belt: its z axis toward the camera, turned by `yaw_rad`.
[[nodiscard]] Pose lying(const Vec3d& size_m, double belt_z_m, double x_m, double y_m,
                         double yaw_rad);

}  // namespace grapnel::test
