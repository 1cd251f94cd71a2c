#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "drivers/replay/camera_file.h"

namespace grapnel {

/// A camera whose published intrinsics a set of recordings uses without repeating them.
struct KnownCamera {
  CameraFile camera;   ///< 640×480
  std::string origin;  ///< for people
};

/// By a word of the set's name in `text` (an index's comment or the folder's path).
[[nodiscard]] std::optional<KnownCamera> known_camera(const std::string& text);

/// A Kinect v1 at its nominal focal length, for images of `width` × `height`: better than nothing,
/// wrong by some per cent.
[[nodiscard]] KnownCamera nominal_camera(int width, int height);

}  // namespace grapnel
