#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "base/depth_frame.h"
#include "drivers/replay/camera_file.h"

namespace grapnel {

/// One depth frame out of files, with its pixels.
struct FrameFile {
  std::vector<std::uint16_t> depth;
  std::vector<Rgb8> color;  ///< empty: none
  CameraFile camera;
  std::int64_t time_us = 0;
  std::uint64_t number = 0;  ///< in its recording

  /// Views this object's pixels.
  [[nodiscard]] DepthFrame frame() const noexcept;
};

/// Does to a frame as the sensor gave it what its camera.toml asks for: counts that mean no reading
/// become 0, the lens is undone in depth and colour, the depth is corrected.
void correct_frame(FrameFile& file);

/// Reads "RECORDING#N", or a 16-bit PNG with its camera.toml and, if wanted, a colour image of the
/// same size. A recording has its own camera.toml; `color` replaces its colour. Throws InputError.
[[nodiscard]] FrameFile read_frame_file(const std::string& name,
                                        const std::optional<std::string>& camera,
                                        const std::optional<std::string>& color);

}  // namespace grapnel
