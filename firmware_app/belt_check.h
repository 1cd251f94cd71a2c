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
  /// Shares of the readings, whether the belt is seen or not. What lies on a belt is above it, so
  /// readings below tell of a sensor that moved; and a belt that moved is nowhere where it was.
  double below_share = 0.0;
  double above_share = 0.0;     ///< than the belt as it is seen
  double in_place_share = 0.0;  ///< nearer to the taught plane than to the shifted one
};

/// Looks for the belt within 6 cm of where it was taught: flat tiles of the image, and the lowest
/// plane on which many of them agree, since whatever lies on the belt is above it. Seen in under
/// half of the tiles, it has a shift and no tilt, and only where it was taught. A view of which
/// over half lies more than 6 cm below the taught plane is no longer one of this belt: its shift is
/// what those pixels say. O(pixels / 16).
[[nodiscard]] BeltDrift measure_belt_drift(const DepthFrame& frame,
                                           const BeltPlane& taught) noexcept;

}  // namespace grapnel
