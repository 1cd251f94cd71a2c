#pragma once

#include <string>
#include <vector>

#include "workbench/teach/fused_model.h"

namespace grapnel {

/// Frames of recordings whose poses are known.
struct GivenPoses {
  std::vector<std::string> recordings;
  std::string frames;              ///< of each recording, as 0,2,4 or 0-16:2; "" = all
  std::vector<std::string> masks;  ///< black = leave out: none, one for all frames or one a frame
  bool still = false;              ///< the camera stood still: ignore groundtruth.txt
};

struct GivenViews {
  std::vector<TaughtView> views;
  double focal_px = 0.0;  ///< of the first recording
};

/// Reads them with the poses of groundtruth.txt (world_from_camera). Throws InputError.
[[nodiscard]] GivenViews read_given_poses(const GivenPoses& wanted);

/// True when `name` is a recording with a groundtruth.txt that has rows.
[[nodiscard]] bool has_given_poses(const std::string& name);

}  // namespace grapnel
