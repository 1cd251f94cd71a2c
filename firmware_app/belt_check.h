#pragma once

#include "base/depth_frame.h"
#include "base/geometry.h"

namespace grapnel {

/// The belt's plane n·p + offset = 0 in the camera's frame, n unit and toward the camera.
struct BeltPlane {
  bool known = false;
  Vec3d normal = Vec3d::Zero();
  double offset_m = 0.0;
};

/// Where the belt is, against where it was taught.
struct BeltDrift {
  bool seen = false;      ///< false: too little of the belt is free to tell
  double shift_m = 0.0;   ///< along the normal at the image's centre, toward the camera positive
  double tilt_rad = 0.0;  ///< between the two planes
};

/// Looks for the belt within 6 cm of where it was taught: flat tiles of the image, and the plane on
/// which most of them agree; whatever lies on the belt has tiles of its own, or none. A view of
/// which over half lies more than that below the taught plane is no longer one of this belt: its
/// shift is what the median pixel says. O(pixels / 16).
[[nodiscard]] BeltDrift measure_belt_drift(const DepthFrame& frame,
                                           const BeltPlane& taught) noexcept;

}  // namespace grapnel
