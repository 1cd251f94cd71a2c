#pragma once

#include <OpenNI.h>

#include <atomic>
#include <cstdint>
#include <string>
#include <vector>

#include "base/clock.h"
#include "drivers/live/color_pairing.h"
#include "drivers/live/sensor_device.h"
#include "drivers/openni2/openni_options.h"

namespace grapnel {

/// A depth camera through OpenNI 2 (Asus Xtion, PrimeSense Carmine, others by plug-ins of OpenNI).
/// On the API thread alone. Frames are polled with bounded waits and read only when one is there:
/// a read without a frame can block for ever. Images are never mirrored; colour is delivered only
/// when the device registers depth to it.
class OpenNiDevice final : public SensorDevice {
 public:
  explicit OpenNiDevice(OpenNiOptions options);
  OpenNiDevice(const OpenNiDevice&) = delete;
  OpenNiDevice& operator=(const OpenNiDevice&) = delete;
  ~OpenNiDevice() override { close(); }

  Result<CameraInfo> open(const std::string& serial) override;
  Status start(FrameExchange& exchange, std::uint64_t generation) override;
  Status pump() override;
  void stop() noexcept override;
  void close() noexcept override;
  [[nodiscard]] std::string problem() const override { return problem_; }

 private:
  [[nodiscard]] Status refuse(Code code, std::string problem);
  [[nodiscard]] Status find(const std::string& serial);
  [[nodiscard]] Status prepare_depth();
  void prepare_color();
  [[nodiscard]] bool set_mode(openni::VideoStream& stream, openni::SensorType sensor,
                              const std::vector<openni::PixelFormat>& formats);
  [[nodiscard]] CameraInfo describe() const;
  void take_frame(int stream);
  void take_depth(const openni::VideoFrameRef& frame);
  void take_color(const openni::VideoFrameRef& frame);
  [[nodiscard]] bool fits(const openni::VideoFrameRef& frame) const;

  const OpenNiOptions options_;
  const MonotonicClock clock_;
  std::string problem_;
  std::string uri_;
  std::string name_;
  std::string serial_;
  openni::Device device_;
  openni::VideoStream depth_;
  openni::VideoStream color_;
  bool has_color_ = false;
  bool streaming_ = false;
  unsigned departures_ = 0;  // of this device before it was opened
  std::uint64_t generation_ = 0;
  ColorPairing pairing_;
};

/// Lines "serial name" of the devices that can be opened. On the API thread.
[[nodiscard]] std::vector<std::string> list_openni_devices();

}  // namespace grapnel
