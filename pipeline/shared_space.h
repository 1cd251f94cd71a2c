#pragma once

#include "base/geometry.h"
#include "pipeline/model_index.h"

namespace grapnel {

/// True when the model's surface encloses a volume, judged by its normals: over a closed surface
/// they cancel out. A part taught from some sides only is open. O(points).
[[nodiscard]] bool encloses_volume(const Surface& model) noexcept;

/// The larger of the shares of each part's surface that lies inside the other one by more than
/// `depth_m`; 1 when the middle of one does, as with two parts in the same pose. Only closed parts
/// have an inside. O(points of the coarse models).
[[nodiscard]] double shared_space(const ModelIndex& a, const Pose& target_from_a,
                                  const ModelIndex& b, const Pose& target_from_b,
                                  double depth_m) noexcept;

}  // namespace grapnel
