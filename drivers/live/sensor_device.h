#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "base/error.h"
#include "drivers/live/frame_exchange.h"
#include "hal/camera.h"

namespace grapnel {

/// One sensor seen through its library. One thread makes all calls, in the order open, then start
/// and stop by turns with pump in between, close; any of them may hang in the library for ever
/// without harm to others, see DeviceSession.
class SensorDevice {
 public:
  virtual ~SensorDevice() = default;

  /// Finds and opens the unit; serial "" opens any.
  virtual Result<CameraInfo> open(const std::string& serial) = 0;
  /// Begins to put frames of this generation into `exchange`.
  virtual Status start(FrameExchange& exchange, std::uint64_t generation) = 0;
  /// Works for about 20 ms. An error: the device is lost and can only be closed.
  virtual Status pump() = 0;
  virtual void stop() noexcept = 0;
  virtual void close() noexcept = 0;
  /// A recording has been played to its end: no more frames are due until the next start().
  [[nodiscard]] virtual bool ended() const noexcept { return false; }
  /// The last failure in one line; "" when there was none.
  [[nodiscard]] virtual std::string problem() const = 0;

  /// Gravity in the sensor's frame, in units of g; false when the sensor can't tell.
  virtual bool read_gravity(std::array<double, 3>& gravity) {
    static_cast<void>(gravity);
    return false;
  }
};

}  // namespace grapnel
