#pragma once

#include <string>
#include <vector>

#include "pipeline/features.h"
#include "workbench/surfaces.h"

namespace grapnel {

/// Interest points of a surface, strongest or first as the detector gives them. Normals are
/// estimated where the surface has none. Throws InputError.
[[nodiscard]] std::vector<Keypoint> detect_keypoints(Surface& surface, const std::string& detector,
                                                     const std::vector<std::string>& overrides);

}  // namespace grapnel
