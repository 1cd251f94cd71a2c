#pragma once

#include <span>
#include <vector>

#include "base/geometry.h"
#include "base/image.h"

namespace grapnel::test {

/// Depth counts with what they mean.
struct DepthPicture {
  ImageView<const std::uint16_t> counts;
  double metres_per_unit = 0.001;
  Intrinsics camera;
};

/// What one picture says about an upright box: z of the box's frame points up, its origin is the
/// middle.
struct BoxView {
  std::vector<Vec3d> surface;  ///< readings near the box, camera frame
  std::vector<Vec3d> rim;      ///< where the depth jumps away beside them, half a pixel outward
  Pose camera_from_box = Pose::Identity();
};

/// The readings within `reach_m` of the box at a rough pose.
[[nodiscard]] BoxView box_view(const DepthPicture& picture, const Pose& camera_from_box,
                               const Vec3d& half_m, double reach_m);

/// Fits the pose in every picture and, over all of them, half the length and width: each face's
/// plane to its readings, the hidden sides to the rim, by Gauss and Newton with Geman and McClure's
/// weights. The height stays: nothing but the floor shows where a side ends. A plain fit of its own
/// for truth: no code of the pipeline takes part.
void fit_boxes(std::span<BoxView> views, Vec3d& half_m);

/// Median distance of the view's readings from the nearest face in sight, metres.
[[nodiscard]] double median_residual_m(const BoxView& view, const Vec3d& half_m);

}  // namespace grapnel::test
