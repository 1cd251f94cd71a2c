#include "firmware_app/sensor_health.h"

#include <cmath>

namespace grapnel {
namespace {

constexpr std::int64_t kWindow_us = 2'000'000;
// Looks a second apart: a hand before the lens is no fault of the sensor.
constexpr int kBlindLooks = 3;
// Of ten readings a second: a shock of the conveyor passes within a second.
constexpr double kSmoothing = 0.1;

double dot(const std::array<double, 3>& a, const std::array<double, 3>& b) noexcept {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/// Exact also for small angles, where the cosine says little.
double angle_rad(const std::array<double, 3>& a, const std::array<double, 3>& b) noexcept {
  const std::array<double, 3> cross = {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2],
                                       a[0] * b[1] - a[1] * b[0]};
  return std::atan2(std::sqrt(dot(cross, cross)), dot(a, b));
}

}  // namespace

Code SensorHealth::fault_of(Code driver) const noexcept {
  return driver == Code::ColorMissing && !capture_.need_color ? Code::SensorHealthy : driver;
}

void SensorHealth::see(const DepthFrame& frame) noexcept {
  blind_looks_ = valid_share(frame) < capture_.min_valid_share ? blind_looks_ + 1 : 0;
}

void SensorHealth::feel(const std::array<float, 3>& gravity) noexcept {
  const std::array<double, 3> now = {gravity[0], gravity[1], gravity[2]};
  if (dot(now, now) == 0.0) return;
  if (!has_reference_) {
    has_reference_ = true;
    reference_ = now;
    if (capture_.gravity.size() == 3) {
      reference_ = {capture_.gravity[0], capture_.gravity[1], capture_.gravity[2]};
    }
    smooth_ = now;
  }
  for (std::size_t i = 0; i < 3; ++i) smooth_[i] += kSmoothing * (now[i] - smooth_[i]);
  tilt_rad_ = angle_rad(smooth_, reference_);
}

void SensorHealth::measure(const CameraStatus& status, std::int64_t now_us) noexcept {
  if (status.state != CameraState::Streaming) {
    window_us_ = 0;
    slow_ = false;
    lossy_ = false;
    return;
  }
  const CameraCounters& now = status.counters;
  if (window_us_ != 0 && now_us - window_us_ < kWindow_us) return;
  if (window_us_ != 0) {
    const auto frames = static_cast<double>(now.frames - at_window_.frames);
    const auto lost = static_cast<double>(now.lost_packets - at_window_.lost_packets);
    slow_ = frames * 1e6 < capture_.min_rate_hz * static_cast<double>(now_us - window_us_);
    lossy_ = lost > frames * capture_.max_lost_packets;
  }
  window_us_ = now_us;
  at_window_ = now;
}

Code SensorHealth::judge(Code driver, const CameraStatus& status, bool live,
                         std::int64_t now_us) noexcept {
  feel(status.gravity);
  measure(status, now_us);
  const Code fault = fault_of(driver);
  if (fault != Code::SensorHealthy || !live) return fault;
  if (slow_) return Code::NoFrameInTime;
  if (lossy_) return Code::LostPackets;
  if (blind_looks_ >= kBlindLooks) return Code::DepthMostlyInvalid;
  if (capture_.max_tilt_rad > 0.0 && tilt_rad_ > capture_.max_tilt_rad) return Code::SensorMoved;
  return Code::SensorHealthy;
}

}  // namespace grapnel
