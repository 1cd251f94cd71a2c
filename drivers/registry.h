#pragma once

#include <filesystem>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "base/clock.h"
#include "base/config.h"
#include "hal/camera.h"

namespace grapnel {

/// A camera driver that is part of the program. A new one is a line in registry.cpp.
struct CameraDriver {
  std::string_view name;
  std::string_view help;
  /// From the [camera] table. Throws InputError.
  std::unique_ptr<Camera> (*make)(const ConfigTable& camera, const Clock& clock);
};

/// The built-in drivers, by name.
[[nodiscard]] std::span<const CameraDriver> camera_drivers() noexcept;

/// Makes the camera of a [camera] table: key `driver` names a built-in driver or a plug-in
/// libgrapnel_camera_NAME.so, looked for in the folder that key `plugins` names (relative to the
/// configuration), else in plugin_folders(). `clock` outlives the camera. Throws InputError naming
/// file, line, key and reason.
[[nodiscard]] std::unique_ptr<Camera> make_camera(const ConfigTable& camera, const Clock& clock);

/// Where plug-ins are looked for: beside the running program, and where it is installed.
[[nodiscard]] std::vector<std::filesystem::path> plugin_folders();

}  // namespace grapnel
