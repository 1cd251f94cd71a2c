#pragma once

#include <filesystem>

#include "drivers/replay/image_file.h"

namespace grapnel {

/// A depth image of fakenect-record: 11 bits of disparity, turned to steps of kKinectFineUnit_m by
/// the nominal constants of a Kinect, since the folder does not hold the unit's own. Throws
/// InputError.
[[nodiscard]] DepthImage read_fakenect_depth(const std::filesystem::path& file);
/// A colour image of fakenect-record. Throws InputError.
[[nodiscard]] ColorImage read_fakenect_color(const std::filesystem::path& file);

}  // namespace grapnel
