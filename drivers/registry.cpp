#include "drivers/registry.h"

#include <algorithm>
#include <array>
#include <string>
#include <system_error>

#include "base/input_error.h"
#include "drivers/auto_camera.h"
#include "drivers/corrected_camera.h"
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
  names.emplace_back("auto");
  text += "auto, or a plug-in that is installed, is";
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

namespace {

std::unique_ptr<Camera> make_plain_camera(const ConfigTable& camera, const Clock& clock) {
  ConfigReader reader(camera);
  reader.require("driver");
  const std::string name = reader.take_text("driver", "");
  for (const CameraDriver& driver : kDrivers) {
    if (driver.name == name) return driver.make(camera, clock);
  }
  const std::vector<std::filesystem::path> folders =
      folders_of(reader.take_text("plugins", ""), camera);
  if (name == "auto") return make_auto_camera(find_plugins(folders), camera, clock);
  if (!plain_name(name)) throw reader.problem("driver", unknown_driver(name));
  const std::string file = "libgrapnel_camera_" + name + ".so";
  for (const auto& folder : folders) {
    if (!std::filesystem::exists(folder / file)) continue;
    try {
      return load_plugin_camera(folder / file, name, camera, clock);
    } catch (const PluginOptionProblem&) {
      throw;
    } catch (const InputError& error) {
      throw reader.problem("driver", error.what());
    }
  }
  throw reader.problem("driver", unknown_driver(name));
}

}  // namespace

std::unique_ptr<Camera> make_camera(const ConfigTable& camera, const Clock& clock) {
  ConfigReader reader(camera);
  const std::string calibration = reader.take_text("calibration", "");
  if (calibration.empty()) return make_plain_camera(camera, clock);
  const std::filesystem::path file =
      std::filesystem::path(camera.file()).parent_path() / calibration;
  if (!std::filesystem::exists(file)) {
    throw reader.problem("calibration", "\"" + calibration +
                                            "\" is not there; a camera.toml or a folder of "
                                            "SERIAL.toml is allowed");
  }
  ConfigTable rest(camera.file(), camera.path(), camera.line());
  for (const auto& [key, value] : camera.entries()) {
    if (key != "calibration") rest.set(key, value);
  }
  return make_corrected_camera(make_plain_camera(rest, clock), file);
}

std::vector<std::filesystem::path> find_plugins(const std::vector<std::filesystem::path>& folders) {
  std::vector<std::filesystem::path> found;
  for (const auto& folder : folders) {
    std::error_code code;
    for (const auto& entry : std::filesystem::directory_iterator(folder, code)) {
      const std::string name = plugin_driver(entry.path());
      const bool known = std::any_of(found.begin(), found.end(), [&](const auto& other) {
        return plugin_driver(other) == name;
      });
      if (plain_name(name) && !known) found.push_back(entry.path());
    }
  }
  std::sort(found.begin(), found.end(), [](const auto& a, const auto& b) {
    const std::string name_a = plugin_driver(a);
    const std::string name_b = plugin_driver(b);
    // A Kinect's own library sees it at once; OpenNI asks all of its drivers.
    const auto rank = [](const std::string& name) { return name == "freenect" ? 0 : 1; };
    return rank(name_a) != rank(name_b) ? rank(name_a) < rank(name_b) : name_a < name_b;
  });
  return found;
}

std::string camera_list() {
  const auto line = [](std::string name, const std::string& text) {
    name.resize(std::max<std::size_t>(name.size() + 1, 13), ' ');
    return name.append(text).append("\n");
  };
  std::string list;
  for (const CameraDriver& driver : kDrivers) {
    list += line(std::string(driver.name), std::string(driver.help));
  }
  list += line("auto", "the first of the following that sees a device");
  for (const std::filesystem::path& file : find_plugins(plugin_folders())) {
    const std::string name = plugin_driver(file);
    try {
      const std::vector<std::string> devices = plugin_devices(file);
      if (devices.empty()) list += line(name, "no device");
      for (const std::string& device : devices) list += line(name, device);
    } catch (const InputError& error) {
      list += line(name, std::string("not usable: ").append(error.what()));
    }
  }
  return list;
}

}  // namespace grapnel
