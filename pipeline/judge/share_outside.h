#pragma once

#include "base/geometry.h"
#include "pipeline/surface.h"

namespace grapnel {

/// Of the model's points that face the camera, the share (0…1) whose projection no pixel of its
/// image holds; 1 when none faces it. O(points).
[[nodiscard]] double share_outside(const Surface& model, const Pose& camera_from_model,
                                   const Intrinsics& camera) noexcept;

}  // namespace grapnel
