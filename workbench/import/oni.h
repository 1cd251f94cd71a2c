#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>

#include "drivers/replay/camera_file.h"

namespace grapnel {

/// What came of it.
struct OniImport {
  std::size_t frames = 0;
  std::size_t colors = 0;
  std::size_t left_out = 0;  ///< frames that the file announces and no player delivers
  CameraFile camera;
  std::string camera_origin;
};

[[nodiscard]] bool is_oni(const std::filesystem::path& file);

/// Plays an .oni file forward in a child process and writes every frame to the new recording
/// `folder`. Times are the file's own, from 0: the sensor's are not in it. Throws InputError.
[[nodiscard]] OniImport import_oni(const std::filesystem::path& file,
                                   const std::filesystem::path& folder,
                                   const std::optional<std::string>& camera_file, bool with_color);

}  // namespace grapnel
