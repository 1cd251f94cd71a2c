#pragma once

#include <cstdint>

#include "base/geometry.h"
#include "base/image.h"

namespace grapnel {

/// The empty belt as taught: expected depth per pixel and the plane through it, camera frame.
struct BeltBackground {
  ImageView<const std::uint16_t>
      depth;  ///< counts of the frame's own unit; 0 = unknown; empty = not taught
  bool has_plane = false;
  Vec3d plane_normal = Vec3d::Zero();  ///< unit, toward the camera
  double plane_offset_m = 0.0;         ///< n·p + offset = 0 on the belt
};

}  // namespace grapnel
