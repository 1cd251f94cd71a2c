#pragma once

#include <span>

#include "pipeline/features.h"

namespace grapnel {

/// Copies the candidates into the set, ascending by point. When more than fit, the strongest stay
/// (ties: the lower point) and the set is marked. Reorders the candidates. O(n log n).
void keep_strongest(std::span<Keypoint> candidates, KeypointSet& keypoints) noexcept;

}  // namespace grapnel
