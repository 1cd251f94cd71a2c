#include "drivers/registry.h"

#include <algorithm>
#include <array>
#include <string>
#include <system_error>

#include "drivers/plugin_camera.h"
#include "drivers/replay/replay_camera.h"
#include "drivers/synthetic/synthetic_camera.h"

namespace grapnel {
namespace {

constexpr std::array kDrivers = {
    CameraDriver{"replay", "a recording, as if it were a camera", &make_replay_camera},
    CameraDriver{"synthetic", "a simulated scene, as if it were a camera", &make_synthetic_camera},
};

/// Letters, digits, '_' and '-', so that a name can't lead out of the plug-in folder.
bool plain_name(std::string_view name) noexcept {
  return !name.empty() && std::all_of(name.begin(), name.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
  });
}

std::vector<std::filesystem::path> folders_of(const std::string& plugins,
                                              const ConfigTable& camera) {
  if (plugins.empty()) return plugin_folders();
  return {std::filesystem::path(camera.file()).parent_path() / plugins};
}

std::string unknown_driver(const std::string& name) {
  std::vector<std::string> names;
  std::string text = "\"" + name + "\" is not allowed; ";
  for (const CameraDriver& driver : kDrivers) {
    names.emplace_back(driver.name);
    text += std::string(driver.name) + ", ";
  }
  text += "or a plug-in that is installed, is";
  const std::string nearest = nearest_name(name, names);
  return nearest.empty() ? text : text + "; did you mean \"" + nearest + "\"?";
}

}  // namespace

std::span<const CameraDriver> camera_drivers() noexcept { return kDrivers; }

std::vector<std::filesystem::path> plugin_folders() {
  std::error_code code;
  const std::filesystem::path program = std::filesystem::read_symlink("/proc/self/exe", code);
  if (code) return {};
  const std::filesystem::path folder = program.parent_path();
  return {folder / "cameras", folder.parent_path() / GRAPNEL_LIBRARY_FOLDER / "grapnel/cameras"};
}

std::unique_ptr<Camera> make_camera(const ConfigTable& camera, const Clock& clock) {
  ConfigReader reader(camera);
  reader.require("driver");
  const std::string name = reader.take_text("driver", "");
  for (const CameraDriver& driver : kDrivers) {
    if (driver.name == name) return driver.make(camera, clock);
  }
  if (!plain_name(name)) throw reader.problem("driver", unknown_driver(name));
  const std::string file = "libgrapnel_camera_" + name + ".so";
  for (const auto& folder : folders_of(reader.take_text("plugins", ""), camera)) {
    if (!std::filesystem::exists(folder / file)) continue;
    try {
      return load_plugin_camera(folder / file, name, camera, clock);
    } catch (const InputError& error) {
      throw reader.problem("driver", error.what());
    }
  }
  throw reader.problem("driver", unknown_driver(name));
}

}  // namespace grapnel
