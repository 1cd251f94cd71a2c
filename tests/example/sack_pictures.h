#pragma once

#include <vector>

#include "tests/example/sack_steps.h"
#include "tests/example/sack_views.h"
#include "workbench/picture/rgb_image.h"

namespace grapnel::example {

/// Both colour images, cut to the sack.
[[nodiscard]] RgbImage draw_views(const SackPair& pair);
/// The source with its keypoints: green where the target has them too.
[[nodiscard]] RgbImage draw_keypoints(const SackPair& pair, const Steps& steps);
/// Both views with lines between matched keypoints: green where right.
[[nodiscard]] RgbImage draw_matches(const SackPair& pair, const Steps& steps,
                                    const std::vector<Correspondence>& matches);
/// Both clouds from the side, the source moved by the pose.
[[nodiscard]] RgbImage draw_merged(const SackPair& pair, const Pose& target_from_source);

}  // namespace grapnel::example
