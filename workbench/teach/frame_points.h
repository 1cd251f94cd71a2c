#pragma once

#include <vector>

#include "base/depth_frame.h"

namespace grapnel {

/// A measured point with its normal, in the camera's frame.
struct SurfaceSample {
  Vec3f point = Vec3f::Zero();
  Vec3f normal = Vec3f::Zero();  ///< unit, toward the camera
  float intensity = 0.0F;
  float weight = 0.0F;  ///< 1 / sigma², 1/m²
};

/// Pixels of a frame that a model can be made of: inside the mask, with a plane through their
/// 7 × 7 window that most of the window agrees with, and not seen at a grazing angle. `mask` may be
/// empty. O(pixels).
[[nodiscard]] std::vector<SurfaceSample> frame_samples(const DepthFrame& frame,
                                                       ImageView<const Rgb8> mask);

}  // namespace grapnel
