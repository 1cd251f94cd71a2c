#include "drivers/auto_camera.h"

#include <algorithm>
#include <atomic>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "base/input_error.h"
#include "drivers/plugin_camera.h"

namespace grapnel {
namespace {

struct Candidate {
  std::filesystem::path file;
  std::unique_ptr<Camera> camera;
};

class AutoCamera final : public Camera {
 public:
  AutoCamera(std::vector<Candidate> candidates, std::string serial, std::string unusable)
      : candidates_(std::move(candidates)),
        serial_(std::move(serial)),
        unusable_(std::move(unusable)) {}

  Result<CameraInfo> open() override {
    if (Camera* const chosen = chosen_.load(); chosen != nullptr) return chosen->open();
    Result<CameraInfo> answer = Error{Code::SensorNotConnected, Stage::Capture, 0};
    std::string looked = serial_.empty()
                             ? "no camera is connected that a driver here can open; looked with:"
                             : "serial " + serial_ + " is wanted and not connected; looked with:";
    for (const Candidate& candidate : candidates_) {
      looked.append(" ").append(plugin_driver(candidate.file));
      const std::vector<std::string> devices = plugin_devices(candidate.file);
      if (std::none_of(devices.begin(), devices.end(),
                       [this](const std::string& line) { return is_wanted(line); })) {
        if (!devices.empty()) answer = Error{Code::WrongSerial, Stage::Capture, 0};
        for (const std::string& device : devices) looked.append(" (sees ").append(device) += ')';
        continue;
      }
      answer = candidate.camera->open();
      if (answer) {
        chosen_.store(candidate.camera.get());
        return answer;
      }
      looked.append(" (").append(candidate.camera->problem()).append(")");
    }
    const std::lock_guard lock(mutex_);
    problem_ = looked + unusable_;
    return answer;
  }
  Status start(FramePool& pool, const CaptureHooks& hooks) override {
    Camera* const chosen = chosen_.load();
    if (chosen == nullptr) return Error{Code::SensorNotConnected, Stage::Capture, 0};
    return chosen->start(pool, hooks);
  }
  void stop() noexcept override {
    if (Camera* const chosen = chosen_.load(); chosen != nullptr) chosen->stop();
  }
  void close() noexcept override {
    if (Camera* const chosen = chosen_.load(); chosen != nullptr) chosen->close();
  }
  [[nodiscard]] CameraStatus status() const noexcept override {
    const Camera* const chosen = chosen_.load();
    return chosen != nullptr ? chosen->status() : CameraStatus{};
  }
  [[nodiscard]] std::string problem() const override {
    if (const Camera* const chosen = chosen_.load(); chosen != nullptr) return chosen->problem();
    const std::lock_guard lock(mutex_);
    return problem_;
  }

 private:
  /// `device` is a line of plugin_devices(): serial and model.
  [[nodiscard]] bool is_wanted(const std::string& device) const {
    return serial_.empty() || device == serial_ || device.starts_with(serial_ + " ");
  }

  std::vector<Candidate> candidates_;
  const std::string serial_;
  const std::string unusable_;  // plug-ins that could not be loaded, and why
  std::atomic<Camera*> chosen_{nullptr};
  mutable std::mutex mutex_;
  std::string problem_;
};

ConfigTable options_for_all(const ConfigTable& camera) {
  ConfigTable options(camera.file(), camera.path(), camera.line());
  for (const auto& [key, value] : camera.entries()) {
    if (key == "serial" || key == "color") options.set(key, value);
  }
  return options;
}

}  // namespace

std::unique_ptr<Camera> make_auto_camera(const std::vector<std::filesystem::path>& plugins,
                                         const ConfigTable& camera, const Clock& clock) {
  ConfigReader reader(camera);
  reader.take_text("driver", "");
  reader.take_text("plugins", "");
  reader.take_bool("color", true);
  const std::string serial = reader.take_text("serial", "");
  reader.finish();
  std::vector<Candidate> candidates;
  std::string unusable;
  for (const std::filesystem::path& file : plugins) {
    try {
      candidates.push_back(
          {file, load_plugin_camera(file, plugin_driver(file), options_for_all(camera), clock)});
    } catch (const InputError& error) {
      unusable.append("; not with ").append(error.what());
    }
  }
  return std::make_unique<AutoCamera>(std::move(candidates), serial, unusable);
}

}  // namespace grapnel
