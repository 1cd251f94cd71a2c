#pragma once

#include <filesystem>
#include <memory>
#include <span>
#include <string>
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
/// configuration), else in plugin_folders(); "auto" is the plug-in that sees a device. `clock`
/// outlives the camera. Throws InputError naming file, line, key and reason.
[[nodiscard]] std::unique_ptr<Camera> make_camera(const ConfigTable& camera, const Clock& clock);

/// Where plug-ins are looked for: beside the running program, and where it is installed.
[[nodiscard]] std::vector<std::filesystem::path> plugin_folders();

/// The plug-ins in these folders, the known drivers first, then by name; of two with one name the
/// first.
[[nodiscard]] std::vector<std::filesystem::path> find_plugins(
    const std::vector<std::filesystem::path>& folders);

/// For a person: each driver that this program has or finds, a line, and the devices each sees.
[[nodiscard]] std::string camera_list();

}  // namespace grapnel
