#pragma once

#include <optional>

#include "base/cloud.h"
#include "drivers/replay/camera_file.h"
#include "drivers/replay/image_file.h"

namespace grapnel {

/// The pinhole camera that an organised cloud was made with: least squares of u over x/z and v over
/// y/z. Nothing when the cloud is no such image (a residual over 0.5 px, or too few points). A
/// cloud looking along -z is taken as turned about x.
[[nodiscard]] std::optional<CameraFile> estimate_camera(const CloudData& cloud);

/// Whole millimetres where all depths are such, as most sensors write; else TUM's 1/5000 m.
[[nodiscard]] double fitting_unit_m(const CloudData& cloud);

/// Depth counts of the grid; no reading, or one beyond 65535 counts, is 0.
[[nodiscard]] DepthImage depth_of(const CloudData& cloud, double metres_per_unit);
/// Empty without colours.
[[nodiscard]] ColorImage colors_of(const CloudData& cloud);

}  // namespace grapnel
