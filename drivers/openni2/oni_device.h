#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/clock.h"
#include "drivers/live/color_pairing.h"
#include "drivers/live/sensor_device.h"
#include "drivers/oni/oni_reader.h"
#include "drivers/openni2/openni_options.h"

namespace grapnel {

/// An .oni file as if it were a camera, at its own pace, forward only. OpenNI plays it in a process
/// of its own: what crashes or hangs there is replaced, or is this device's error.
class OniDevice final : public SensorDevice {
 public:
  OniDevice(OpenNiOptions options, std::filesystem::path player);

  Result<CameraInfo> open(const std::string& serial) override;
  Status start(FrameExchange& exchange, std::uint64_t generation) override;
  Status pump() override;
  void stop() noexcept override;
  void close() noexcept override { reader_.reset(); }
  [[nodiscard]] bool ended() const noexcept override { return ended_; }
  [[nodiscard]] std::string problem() const override { return problem_; }

 private:
  [[nodiscard]] bool begin();
  [[nodiscard]] CameraInfo describe() const;
  /// Reads up to the next frame, or the end.
  [[nodiscard]] bool fetch();
  void deliver();
  void turn_over();

  const OpenNiOptions options_;
  const std::filesystem::path player_;
  const MonotonicClock clock_;
  std::string problem_;
  std::unique_ptr<OniReader> reader_;
  ColorPairing pairing_;
  std::vector<Rgb8> color_;
  std::uint64_t generation_ = 0;
  std::optional<OniRecord> record_;  // read and not yet due
  std::vector<std::byte> bytes_;
  bool streaming_ = false;
  bool paced_ = false;          // offset_us_ holds
  std::int64_t offset_us_ = 0;  // host minus recording
  std::int64_t round_us_ = 0;   // recording's time at which this round began
  std::int64_t last_us_ = 0;
  std::int64_t round_index_ = 0;
  std::int64_t last_index_ = 0;
  bool ended_ = false;
};

}  // namespace grapnel
