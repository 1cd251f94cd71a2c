#include "firmware_app/sensor_health.h"

#include <cmath>

namespace grapnel {
namespace {

constexpr std::int64_t kWindow_us = 2'000'000;
// Looks a second apart: a hand before the lens is no fault of the sensor.
constexpr int kBlindLooks = 3;
// A carton that stays before the camera for less is no other belt.
constexpr int kStrangeLooks = 5;
// Parts that cover the whole view for longer are taken for a belt that came nearer.
constexpr int kCoveredLooks = 300;
// Shares of the readings: of the belt that shows between parts, of a part on it, of what would have
// to be inside the belt.
constexpr double kShowsBelt = 0.02;
constexpr double kShowsPart = 0.1;
constexpr double kShowsBelow = 0.05;
// A sensor that was away for longer has cooled.
constexpr std::int64_t kCooled_us = 60'000'000;
// Of ten readings a second: a shock of the conveyor passes within a second.
constexpr double kSmoothing = 0.1;

double dot(const std::array<double, 3>& a, const std::array<double, 3>& b) noexcept {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/// Some of the belt is where it was taught, and nothing is where it would be inside the belt.
bool shows_belt(const BeltDrift& drift) noexcept {
  return drift.in_place_share >= kShowsBelt && drift.below_share < kShowsBelow;
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
  look_at_belt(frame);
}

void SensorHealth::look_at_belt(const DepthFrame& frame) noexcept {
  if (!belt_.known || capture_.max_belt_shift_m == 0.0) return;
  const BeltDrift drift = measure_belt_drift(frame, belt_);
  const bool tilted = capture_.max_tilt_rad > 0.0 && drift.tilt_rad > capture_.max_tilt_rad;
  const bool strange = tilted || std::abs(drift.shift_m) > capture_.max_belt_shift_m;
  const bool covered = is_covered(drift);
  if (shows_belt(drift)) strange_looks_ = 0;
  if (!drift.seen || (strange && covered)) return;
  drift_ = drift;
  strange_looks_ = strange ? strange_looks_ + 1 : 0;
}

bool SensorHealth::is_covered(const BeltDrift& drift) noexcept {
  if (drift.below_share >= kShowsBelow) return false;
  const bool carries_parts = drift.above_share >= kShowsPart;
  if (shows_belt(drift)) {
    came_in_parts_ = carries_parts;
    covered_looks_ = 0;
    return true;
  }
  // Nothing is left where the belt was: a part covers the view that was seen to come, or the sensor
  // moved, and then parts lie on what is seen.
  return !carries_parts && came_in_parts_ && ++covered_looks_ <= kCoveredLooks;
}

void SensorHealth::follow_stream(const CameraStatus& status, std::int64_t now_us) noexcept {
  const bool streams = status.state == CameraState::Streaming;
  if (!streams && away_since_us_ == 0) away_since_us_ = now_us;
  if (!streams) return;
  const bool cooled = away_since_us_ != 0 && now_us - away_since_us_ > kCooled_us;
  if (warm_from_us_ == 0 || cooled) warm_from_us_ = now_us;
  away_since_us_ = 0;
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
  follow_stream(status, now_us);
  const Code fault = fault_of(driver);
  if (fault != Code::SensorHealthy || !live) return fault;
  if (now_us - warm_from_us_ < std::int64_t{capture_.warm_up_s} * 1'000'000) {
    return Code::WarmingUp;
  }
  if (slow_) return Code::NoFrameInTime;
  if (lossy_) return Code::LostPackets;
  if (blind_looks_ >= kBlindLooks) return Code::DepthMostlyInvalid;
  if (capture_.max_tilt_rad > 0.0 && tilt_rad_ > capture_.max_tilt_rad) return Code::SensorMoved;
  if (strange_looks_ >= kStrangeLooks) return Code::SensorMoved;
  return Code::SensorHealthy;
}

}  // namespace grapnel
