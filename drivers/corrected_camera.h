#pragma once

#include <filesystem>
#include <memory>

#include "hal/camera.h"

namespace grapnel {

/// A camera with its calibration: `calibration` is a camera.toml, or a folder with one named
/// SERIAL.toml for each unit. Its intrinsics, lens distortion, infrared shift and depth correction
/// then hold for every frame, whatever driver delivers it. A file of another unit's serial is
/// refused (WrongSerial); a folder without a file of this unit changes nothing.
[[nodiscard]] std::unique_ptr<Camera> make_corrected_camera(std::unique_ptr<Camera> camera,
                                                            std::filesystem::path calibration);

}  // namespace grapnel
