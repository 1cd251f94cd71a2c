#include "drivers/plugin_camera.h"

#include <dlfcn.h>

#include <array>
#include <sstream>
#include <string_view>
#include <utility>

#include "base/config_text.h"
#include "hal/camera_plugin.h"

namespace grapnel {
namespace {

/// A loaded shared object, unloaded at the end.
struct CloseLibrary {
  void operator()(void* library) const noexcept { ::dlclose(library); }
};
using Library = std::unique_ptr<void, CloseLibrary>;

Library load(const std::filesystem::path& file) {
  Library library(::dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL));
  if (library == nullptr) {
    const char* const reason = ::dlerror();
    throw InputError(file.string() +
                     ": can't be loaded: " + (reason != nullptr ? reason : "unknown reason"));
  }
  return library;
}

/// Hands every call to the plug-in's camera and destroys it where it was made.
class PluginCamera final : public Camera {
 public:
  PluginCamera(Library library, const GrapnelCameraPlugin& plugin, Camera* camera) noexcept
      : library_(std::move(library)), plugin_(plugin), camera_(camera) {}
  PluginCamera(const PluginCamera&) = delete;
  PluginCamera& operator=(const PluginCamera&) = delete;
  ~PluginCamera() override { plugin_.destroy(camera_); }

  Result<CameraInfo> open() override { return camera_->open(); }
  Status start(FramePool& pool, const CaptureHooks& hooks) override {
    return camera_->start(pool, hooks);
  }
  void stop() noexcept override { camera_->stop(); }
  void close() noexcept override { camera_->close(); }
  [[nodiscard]] CameraStatus status() const noexcept override { return camera_->status(); }
  [[nodiscard]] std::string problem() const override { return camera_->problem(); }

 private:
  Library library_;
  const GrapnelCameraPlugin& plugin_;
  Camera* camera_;
};

const GrapnelCameraPlugin& entry_of(const std::filesystem::path& file, void* library,
                                    const std::string& driver) {
  const auto entry =
      reinterpret_cast<GrapnelCameraPluginEntry>(::dlsym(library, kGrapnelCameraPluginSymbol));
  if (entry == nullptr) {
    throw InputError(file.string() + ": is not a camera plug-in; it exports no " +
                     kGrapnelCameraPluginSymbol);
  }
  const GrapnelCameraPlugin* const plugin = entry();
  if (plugin == nullptr || plugin->abi_version != kGrapnelCameraAbi) {
    throw InputError(file.string() + ": was built for camera interface " +
                     std::to_string(plugin == nullptr ? 0 : plugin->abi_version) +
                     "; this program has " + std::to_string(kGrapnelCameraAbi));
  }
  if (plugin->name == nullptr || driver != plugin->name || plugin->create == nullptr ||
      plugin->destroy == nullptr) {
    throw InputError(file.string() + ": is not the plug-in of driver \"" + driver + "\"");
  }
  return *plugin;
}

std::string options_of(const ConfigTable& camera) {
  ConfigTable options(camera.file(), camera.path(), camera.line());
  for (const auto& [key, value] : camera.entries()) {
    if (key != "driver" && key != "plugins") options.set(key, value);
  }
  return config_text(options);
}

/// "camera:2: depht: unknown key" speaks of the copy that options_of() made: the key's place in the
/// original instead. Other text is about the plug-in as a whole.
PluginOptionProblem option_problem(const ConfigTable& camera, const std::filesystem::path& file,
                                   const std::string& text) {
  const std::size_t colon = text.find(": ");
  const std::size_t end = colon == std::string::npos ? colon : text.find(": ", colon + 2);
  const std::string key =
      end != std::string::npos ? text.substr(colon + 2, end - colon - 2) : std::string();
  const ConfigReader reader(camera);
  if (!key.empty() && reader.has(key)) {
    return PluginOptionProblem(reader.problem(key, text.substr(end + 2)).what());
  }
  return PluginOptionProblem(reader.problem("driver", file.string() + ": " + text).what());
}

}  // namespace

std::string plugin_driver(const std::filesystem::path& file) {
  const std::string name = file.filename().string();
  const std::string_view prefix = "libgrapnel_camera_";
  const std::string_view suffix = ".so";
  if (!name.starts_with(prefix) || !name.ends_with(suffix)) return {};
  return name.substr(prefix.size(), name.size() - prefix.size() - suffix.size());
}

std::vector<std::string> plugin_devices(const std::filesystem::path& file) {
  const Library library = load(file);
  const GrapnelCameraPlugin& plugin = entry_of(file, library.get(), plugin_driver(file));
  std::vector<std::string> devices;
  std::array<char, 2048> lines{};
  if (plugin.list == nullptr || plugin.list(lines.data(), lines.size()) <= 0) return devices;
  lines.back() = '\0';
  std::istringstream text(lines.data());
  for (std::string line; std::getline(text, line);) devices.push_back(line);
  return devices;
}

std::unique_ptr<Camera> load_plugin_camera(const std::filesystem::path& file,
                                           const std::string& driver, const ConfigTable& camera,
                                           const Clock& clock) {
  Library library = load(file);
  const GrapnelCameraPlugin& plugin = entry_of(file, library.get(), driver);
  std::array<char, 256> problem{};
  Camera* const made =
      plugin.create(options_of(camera).c_str(), &clock, problem.data(), problem.size());
  if (made == nullptr) {
    problem.back() = '\0';
    throw option_problem(camera, file, problem.data());
  }
  return std::make_unique<PluginCamera>(std::move(library), plugin, made);
}

}  // namespace grapnel
