#pragma once

#include <array>
#include <cstdint>

#include "base/code.h"
#include "base/depth_frame.h"
#include "firmware_app/belt_check.h"
#include "firmware_app/settings.h"
#include "hal/camera.h"

namespace grapnel {

/// Judges a camera by what it delivers, between jobs: its rate, lost packets, share of readings,
/// colour, tilt, and where it sees the belt. What a driver itself complains of comes first. Called
/// by housekeeping alone.
class SensorHealth {
 public:
  explicit SensorHealth(const CaptureSettings& capture) : capture_(capture) {}

  /// What the driver's code means here: missing colour is no fault where nothing needs it.
  [[nodiscard]] Code fault_of(Code driver) const noexcept;
  /// Looks at the newest frame; at most once a second is enough.
  void see(const DepthFrame& frame) noexcept;
  /// The sensor's code at this moment. Every 100 ms.
  [[nodiscard]] Code judge(Code driver, const CameraStatus& status, bool live,
                           std::int64_t now_us) noexcept;
  /// The place as it is now is the right one: the background has been learned anew.
  void take_reference() noexcept { has_reference_ = false; }
  /// Where the belt belongs; unknown: it is not watched.
  void watch_belt(const BeltPlane& belt) noexcept {
    belt_ = belt;
    drift_ = {};
    strange_looks_ = 0;
    came_in_parts_ = false;
    covered_looks_ = 0;
  }
  /// The belt as seen last against where it belongs.
  [[nodiscard]] const BeltDrift& belt_drift() const noexcept { return drift_; }
  /// Angle by which the camera has turned from its reference; 0 while unknown.
  [[nodiscard]] double tilt_rad() const noexcept { return tilt_rad_; }

 private:
  void feel(const std::array<float, 3>& gravity) noexcept;
  void measure(const CameraStatus& status, std::int64_t now_us) noexcept;

  void follow_stream(const CameraStatus& status, std::int64_t now_us) noexcept;
  void look_at_belt(const DepthFrame& frame) noexcept;
  /// What is seen instead of the belt came onto it and is not the belt itself.
  [[nodiscard]] bool is_covered(const BeltDrift& drift) noexcept;

  CaptureSettings capture_;
  BeltPlane belt_;
  BeltDrift drift_;
  int strange_looks_ = 0;
  bool came_in_parts_ = false;  // at the last look at the belt, something lay on it
  int covered_looks_ = 0;
  std::int64_t warm_from_us_ = 0;  // 0: never streamed
  std::int64_t away_since_us_ = 0;
  bool has_reference_ = false;
  std::array<double, 3> reference_{};
  std::array<double, 3> smooth_{};
  double tilt_rad_ = 0.0;

  std::int64_t window_us_ = 0;  // when the one under way began; 0: none
  CameraCounters at_window_;
  bool slow_ = false;
  bool lossy_ = false;
  int blind_looks_ = 0;
};

}  // namespace grapnel
