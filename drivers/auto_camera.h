#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "base/clock.h"
#include "base/config.h"
#include "hal/camera.h"

namespace grapnel {

/// `driver = "auto"`: of the drivers given, the first that sees a device, or the device with the
/// serial number wanted. Every plug-in is loaded here, before the program has other threads; the
/// choice falls when open() first succeeds and stands from then on. The table may hold `serial` and
/// `color`. Throws InputError.
[[nodiscard]] std::unique_ptr<Camera> make_auto_camera(
    const std::vector<std::filesystem::path>& plugins, const ConfigTable& camera,
    const Clock& clock);

}  // namespace grapnel
