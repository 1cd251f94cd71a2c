#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>

#include "drivers/replay/image_file.h"

namespace grapnel {

/// Reads the two kinds of TIFF 6.0 that depth recorders write: one channel of 16 bits, or three of
/// 8, in strips, plain or PackBits. Throws InputError for any other, damaged or cut off.
[[nodiscard]] DepthImage read_depth_tiff(const std::filesystem::path& file);
[[nodiscard]] ColorImage read_color_tiff(const std::filesystem::path& file);
[[nodiscard]] DepthImage decode_depth_tiff(std::span<const std::byte> bytes,
                                           const std::string& name);
[[nodiscard]] ColorImage decode_color_tiff(std::span<const std::byte> bytes,
                                           const std::string& name);

}  // namespace grapnel
