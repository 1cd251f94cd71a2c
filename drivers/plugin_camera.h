#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "base/clock.h"
#include "base/config.h"
#include "base/input_error.h"
#include "hal/camera.h"

namespace grapnel {

/// What a plug-in complains of in its options, said of the key in the file that they come from.
class PluginOptionProblem : public InputError {
 public:
  using InputError::InputError;
};

/// A camera out of the shared object `file`, which stays loaded while the camera lives. `driver` is
/// the name the plug-in must answer to; `camera` the [camera] table, handed over without the keys
/// `driver` and `plugins`. Throws InputError: not loadable, not a plug-in, another ABI; or
/// PluginOptionProblem.
[[nodiscard]] std::unique_ptr<Camera> load_plugin_camera(const std::filesystem::path& file,
                                                         const std::string& driver,
                                                         const ConfigTable& camera,
                                                         const Clock& clock);

/// The driver's name in a plug-in's file name, "" when it has none.
[[nodiscard]] std::string plugin_driver(const std::filesystem::path& file);

/// The devices that the plug-in sees, one line each: serial number and model. May take seconds.
/// Throws InputError as above.
[[nodiscard]] std::vector<std::string> plugin_devices(const std::filesystem::path& file);

}  // namespace grapnel
