#pragma once

#include <cstdint>
#include <span>

#include "drivers/synthetic/scene.h"

namespace grapnel {

/// What a scene's faults do to one frame of the sensor.
struct FrameFaults {
  bool missing = false;       ///< the frame never arrives
  bool lost = false;          ///< …because the sensor is away
  bool dropped = false;       ///< …because it was lost on its way: the sensor counts it
  bool wrong_serial = false;  ///< another unit answers at the next opening
  bool torn = false;          ///< its lower half is still that of the frame before
  bool all_zero = false;
};

/// Looks a frame, counted from the first one without ever starting over, up in the script.
/// O(faults).
[[nodiscard]] FrameFaults faults_at(std::span<const SceneFault> faults,
                                    std::int64_t frame) noexcept;

/// Packets of a torn frame that count as lost: half of the 242 that Kinect's depth image takes.
inline constexpr std::uint32_t kTornPackets = 121;

/// Ticks of the device's clock per microsecond, as Kinect's (60 MHz), in 32 bits.
inline constexpr std::int64_t kDeviceTicksPerUs = 60;

/// The device's 32-bit clock at a time since the scene's start. It passes its end at the frame that
/// a ClockWrap names, else 2^32 ticks after the start.
[[nodiscard]] std::uint32_t device_ticks(std::span<const SceneFault> faults, double rate_hz,
                                         std::int64_t time_us) noexcept;

/// Unwraps a 32-bit tick counter to 64-bit microseconds, for readings less than one wrap apart.
class TickUnwrapper {
 public:
  [[nodiscard]] std::int64_t time_us(std::uint32_t ticks) noexcept {
    // The difference modulo 2^32 is right whether or not the counter has wrapped in between.
    if (started_) total_ += static_cast<std::uint32_t>(ticks - last_);
    if (!started_) total_ = ticks;
    started_ = true;
    last_ = ticks;
    return static_cast<std::int64_t>(total_ / static_cast<std::uint64_t>(kDeviceTicksPerUs));
  }

 private:
  bool started_ = false;
  std::uint32_t last_ = 0;
  std::uint64_t total_ = 0;
};

}  // namespace grapnel
