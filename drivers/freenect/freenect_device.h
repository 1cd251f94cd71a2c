#pragma once

#include <libfreenect.h>

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "base/clock.h"
#include "drivers/freenect/freenect_options.h"
#include "drivers/freenect/packet_assembler.h"
#include "drivers/freenect/registration_map.h"
#include "drivers/live/color_pairing.h"
#include "drivers/live/frame_timer.h"
#include "drivers/live/sensor_device.h"

namespace grapnel {

/// A Kinect v1 through libfreenect. Only its camera is needed; without motor, or with more than one
/// Kinect, of which none says which motor is whose, it can't tell its tilt. Frames are whole or say
/// how many packets they lack; what those would have filled reads as no reading, black in colour.
/// Colour is that of the depth pixels and within 2 ms of device time, else missing.
class FreenectDevice final : public SensorDevice {
 public:
  explicit FreenectDevice(FreenectOptions options);
  ~FreenectDevice() override { close(); }

  Result<CameraInfo> open(const std::string& serial) override;
  Status start(FrameExchange& exchange, std::uint64_t generation) override;
  Status pump() override;
  void stop() noexcept override;
  void close() noexcept override;
  [[nodiscard]] std::string problem() const override { return problem_; }
  bool read_gravity(std::array<double, 3>& gravity) override;

 private:
  struct Packets {
    std::uint32_t lost = 0;  // of the frame about to be delivered
    std::uint32_t cut = 0;   // that came too short since the one before
  };

  [[nodiscard]] Status find_and_open(const std::string& serial, std::string& found);
  [[nodiscard]] Status refuse(Code code, std::string problem);
  void open_motor();
  [[nodiscard]] CameraInfo describe(const std::string& serial) const;

  static void on_log(freenect_context* context, freenect_loglevel level, const char* text);
  void read_log(freenect_loglevel level, const char* text);
  void on_depth(const std::uint16_t* pixels, std::uint32_t ticks);
  void on_color(const Rgb8* pixels, std::uint32_t ticks);
  void fill_depth(const std::uint16_t* pixels, std::uint16_t* out) const noexcept;
  void attach(FrameExchange::Slot& slot, const std::vector<Rgb8>& color);

  const FreenectOptions options_;
  const MonotonicClock clock_;
  freenect_context* context_ = nullptr;
  freenect_device* camera_ = nullptr;
  freenect_device* motor_ = nullptr;
  std::size_t units_ = 0;
  std::unique_ptr<RegistrationMap> map_;
  std::string problem_;
  std::string complaint_;  // of the library
  bool streaming_ = false;
  bool gone_ = false;

  std::uint64_t generation_ = 0;
  ColorPairing pairing_;
  TickUnwrapper depth_clock_;
  std::uint32_t depth_ticks_ = 0;
  std::int64_t depth_us_ = 0;
  Packets depth_packets_;
  Packets color_packets_;
  PacketAssembler depth_raw_;
  PacketAssembler color_raw_;
};

/// Serial numbers of the Kinects that can be opened.
[[nodiscard]] std::vector<std::string> list_kinects();

}  // namespace grapnel
