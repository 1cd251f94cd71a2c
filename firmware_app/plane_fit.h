#pragma once

#include <cstdint>

#include "base/geometry.h"
#include "base/image.h"

namespace grapnel {

/// A plane n·p + offset = 0 in the camera's frame, n unit and toward the camera.
struct FittedPlane {
  bool found = false;
  Vec3d normal = Vec3d::Zero();
  double offset_m = 0.0;
  double inlier_share = 0.0;  ///< of the pixels looked at that have a reading
  double rms_m = 0.0;         ///< of the inliers
};

/// The plane that most of the image lies on: RANSAC over a coarse grid with a fixed seed, then
/// least squares over its inliers. Not found when under 30 % of the readings agree. `depth` in
/// counts, 0 = no reading. O(pixels / 16 × 64).
[[nodiscard]] FittedPlane fit_dominant_plane(ImageView<const std::uint16_t> depth,
                                             double metres_per_unit,
                                             const Intrinsics& intrinsics) noexcept;

}  // namespace grapnel
