#pragma once

#include <cstdint>

#include "drivers/live/frame_exchange.h"

namespace grapnel {

/// Unwraps a 32-bit counter of `ticks_per_us` ticks to 64-bit microseconds, for readings less than
/// one wrap apart. A counter that runs backwards appears as a leap of nearly one wrap.
class TickUnwrapper {
 public:
  explicit TickUnwrapper(std::uint32_t ticks_per_us) noexcept : ticks_per_us_(ticks_per_us) {}
  [[nodiscard]] std::int64_t time_us(std::uint32_t ticks) noexcept {
    // The difference modulo 2^32 is right whether or not the counter has wrapped in between.
    total_ += started_ ? static_cast<std::uint32_t>(ticks - last_) : ticks;
    started_ = true;
    last_ = ticks;
    return static_cast<std::int64_t>(total_ / ticks_per_us_);
  }

 private:
  std::uint32_t ticks_per_us_;
  bool started_ = false;
  std::uint32_t last_ = 0;
  std::uint64_t total_ = 0;
};

/// Where a frame lies in time and in the sensor's count.
struct FrameTime {
  std::int64_t device_us = 0;    ///< strictly increasing, also over re-openings
  std::int64_t exposure_us = 0;  ///< host monotonic time of mid-exposure, strictly increasing
  std::uint64_t sequence = 0;    ///< strictly increasing; frames that never arrived leave gaps
  std::uint64_t missed = 0;      ///< frames lost just before this one while the stream ran
  bool clock_fault = false;      ///< the device's clock stood still or leapt; host time was used
};

/// Gives the frames of a live sensor their times. The device's clock and the host's drift against
/// each other, and frames arrive late by a varying time, never early: the offset follows the
/// earliest arrivals at once and rises by at most `kDrift`, the worst of two quartz clocks.
class FrameTimer {
 public:
  static constexpr double kDrift = 200e-6;

  /// `latency_us`: from mid-exposure to the device's time stamp.
  FrameTimer(double rate_hz, std::int64_t latency_us) noexcept
      : period_us_(1e6 / rate_hz), latency_us_(latency_us) {}

  [[nodiscard]] FrameTime next(const SensorStamp& stamp) noexcept;
  /// The stream was stopped: what comes next is no loss.
  void pause() noexcept { paused_ = true; }

 private:
  [[nodiscard]] std::uint64_t frames_since(const SensorStamp& stamp,
                                           std::int64_t passed_us) const noexcept;

  double period_us_;
  std::int64_t latency_us_;
  bool started_ = false;
  bool paused_ = true;
  SensorStamp last_;
  FrameTime time_;
  double offset_us_ = 0.0;  // host minus device
};

}  // namespace grapnel
