#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "base/clock.h"
#include "base/config.h"
#include "hal/camera.h"

namespace grapnel {

/// A camera out of the shared object `file`, which stays loaded while the camera lives. `driver` is
/// the name the plug-in must answer to; `camera` the [camera] table, handed over without the keys
/// `driver` and `plugins`. Throws InputError: not loadable, not a plug-in, another ABI, or what the
/// plug-in itself complains of.
[[nodiscard]] std::unique_ptr<Camera> load_plugin_camera(const std::filesystem::path& file,
                                                         const std::string& driver,
                                                         const ConfigTable& camera,
                                                         const Clock& clock);

}  // namespace grapnel
