#pragma once

#include <cstddef>
#include <filesystem>

#include "drivers/replay/frame_file.h"
#include "drivers/replay/image_file.h"

namespace grapnel {

/// A depth image of fakenect-record: 11 bits of disparity, turned to steps of kKinectFineUnit_m by
/// the nominal constants of a Kinect, since the folder does not hold the unit's own. Throws
/// InputError.
[[nodiscard]] DepthImage read_fakenect_depth(const std::filesystem::path& file);
/// A colour image of fakenect-record. Throws InputError.
[[nodiscard]] ColorImage read_fakenect_color(const std::filesystem::path& file);

/// True when the folder is one of fakenect-record.
[[nodiscard]] bool is_fakenect(const std::filesystem::path& folder);
/// Frame `number` of depth, from 0, by a Kinect's nominal constants; without colour, which is not
/// that of the depth's pixels. Throws InputError, also when there is no such frame.
[[nodiscard]] FrameFile read_fakenect_frame(const std::filesystem::path& folder,
                                            std::size_t number);

}  // namespace grapnel
