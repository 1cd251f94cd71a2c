#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>

#include "drivers/replay/camera_file.h"
#include "drivers/replay/frame_file.h"

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

/// Frame `number` of depth, from 0, with the colour nearest in time, as the file has them:
/// everything before it is played. Throws InputError, also when there is no such frame.
[[nodiscard]] FrameFile read_oni_frame(const std::filesystem::path& file, std::size_t number);

}  // namespace grapnel
