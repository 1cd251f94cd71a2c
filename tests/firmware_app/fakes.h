#pragma once

#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <string>

#include <unistd.h>

#include "firmware_app/job_runner.h"
#include "firmware_app/preset_source.h"
#include "hal/camera.h"

namespace grapnel::test {

/// A folder of its own that goes away with the test.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string pattern = (std::filesystem::temp_directory_path() / "grapnel-XXXXXX").string();
    path_ = ::mkdtemp(pattern.data());
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  ~TemporaryFolder() {
    std::error_code error;
    std::filesystem::remove_all(path_, error);
  }
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  std::filesystem::path write(const std::string& name, const std::string& text) const {
    const std::filesystem::path file = path_ / name;
    std::filesystem::create_directories(file.parent_path());
    std::ofstream(file, std::ios::binary) << text;
    return file;
  }

 private:
  std::filesystem::path path_;
};

/// A camera of which only the status matters.
class StatusCamera final : public Camera {
 public:
  Result<CameraInfo> open() override { return Error{Code::SensorNotConnected}; }
  Status start(FramePool&, const CaptureHooks&) override { return Error{Code::Busy}; }
  void stop() noexcept override {}
  void close() noexcept override {}
  [[nodiscard]] CameraStatus status() const noexcept override { return status_; }
  [[nodiscard]] std::string problem() const override { return ""; }
  [[nodiscard]] bool stepped() const noexcept override { return on_request != nullptr; }
  void request_frame() noexcept override { on_request(++requests_); }
  [[nodiscard]] int requests() const { return requests_; }
  /// Makes the camera a stepped one; told the number of requests so far.
  std::function<void(int)> on_request;

  void set(CameraState state, Code code) {
    status_.state = state;
    status_.code = code;
  }

 private:
  CameraStatus status_{CameraState::Streaming, Code::SensorHealthy, {}};
  int requests_ = 0;
};

/// Answers what the test tells it to, and remembers what it was asked.
class FakeRunner final : public JobRunner {
 public:
  std::function<Result<RegistrationReports>(const DepthFrame&, const JobContext&)> answer;
  double occupied = 0.0;
  int runs = 0;

  Result<RegistrationReports> run(const DepthFrame& frame,
                                  const JobContext& context) noexcept override {
    ++runs;
    return answer(frame, context);
  }
  Result<double> occupied_share(const DepthFrame&, const JobContext&) noexcept override {
    return occupied;
  }
};

/// Presets 11 and 12 exist, 13 is broken, 14 too large.
class FakePresetSource final : public PresetSource {
 public:
  std::unique_ptr<ActivePreset> load(const Settings& settings, std::uint16_t number,
                                     std::span<std::byte> memory) override {
    check(settings, number, memory.size());
    auto preset = std::make_unique<ActivePreset>();
    preset->profile.preset.number = number;
    preset->profile.preset.rev = static_cast<std::uint16_t>(1000 + number);
    preset->profile.calibrated = settings.calibrated();
    last_memory = memory;
    return preset;
  }
  void check(const Settings&, std::uint16_t number, std::size_t) override {
    if (number == 13) throw ConfigProblem(Code::PresetInvalid, "13-broken.toml:4: bad value");
    if (number == 15) throw std::filesystem::filesystem_error("deleted meanwhile", {});
    if (number == 14) throw ConfigProblem(Code::OverMemoryBudget, "14-large.toml: too large");
    if (number != 11 && number != 12) throw ConfigProblem(Code::PresetMissing, "no such preset");
  }
  std::span<std::byte> last_memory;
};

}  // namespace grapnel::test
