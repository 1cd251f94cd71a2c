#include "drivers/live/frame_timer.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace grapnel {
namespace {

// More than any wait of the host for a processor, less than half a wrap of a 32-bit counter.
constexpr std::int64_t kLeap_us = 5'000'000;

}  // namespace

std::uint64_t FrameTimer::frames_since(const SensorStamp& stamp,
                                       std::int64_t passed_us) const noexcept {
  const bool counted = stamp.index != 0 && last_.index != 0;
  if (counted && stamp.generation == last_.generation && stamp.index > last_.index) {
    return stamp.index - last_.index;
  }
  const double frames = std::floor(static_cast<double>(passed_us) / period_us_ + 0.5);
  return static_cast<std::uint64_t>(std::max(1.0, frames));
}

FrameTime FrameTimer::next(const SensorStamp& stamp) noexcept {
  const std::int64_t host_us = std::max<std::int64_t>(1, stamp.arrival_us - last_.arrival_us);
  const std::int64_t delta_us = stamp.device_us - last_.device_us;
  const bool same_clock = started_ && stamp.generation == last_.generation;
  time_.clock_fault = same_clock && (delta_us <= 0 || std::abs(delta_us - host_us) > kLeap_us);
  const bool trusted = same_clock && !time_.clock_fault;
  const std::int64_t passed_us = trusted ? delta_us : host_us;
  const std::uint64_t steps = started_ ? frames_since(stamp, passed_us) : 1;

  time_.device_us = started_ ? time_.device_us + passed_us : stamp.device_us;
  const double offset_us = static_cast<double>(stamp.arrival_us - time_.device_us);
  const double risen_us = offset_us_ + kDrift * static_cast<double>(host_us);
  offset_us_ = trusted ? std::min(offset_us, risen_us) : offset_us;
  const auto exposure_us = time_.device_us + static_cast<std::int64_t>(offset_us_) - latency_us_;
  time_.exposure_us = started_ ? std::max(exposure_us, time_.exposure_us + 1) : exposure_us;
  time_.sequence += started_ ? steps : 0;
  time_.missed = trusted && !paused_ ? steps - 1 : 0;

  last_ = stamp;
  started_ = true;
  paused_ = false;
  return time_;
}

}  // namespace grapnel
