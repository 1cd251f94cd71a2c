#pragma once

#include <libfreenect.h>
#include <libfreenect_registration.h>

#include <array>
#include <cstdint>
#include <vector>

#include "base/geometry.h"
#include "base/image.h"
#include "drivers/live/kinect_law.h"

namespace grapnel {

inline constexpr int kKinectWidth = 640;
inline constexpr int kKinectHeight = 480;
inline constexpr std::size_t kKinectPixels = std::size_t{kKinectWidth} * kKinectHeight;
/// Size of one step in mode Raw.
inline constexpr double kFineUnit_m = kKinectFineUnit_m;

/// A unit's factory constants, and what follows from them.
class RegistrationMap {
 public:
  explicit RegistrationMap(freenect_device* device);

  /// Of the infrared camera, by the zero plane: f = distance / pixel size (which is that of the
  /// full 1280-pixel image), centre as the library assumes it.
  [[nodiscard]] Intrinsics intrinsics() const noexcept;
  [[nodiscard]] double baseline_m() const noexcept { return baseline_m_; }
  /// Raw 11-bit value to steps of kFineUnit_m, 0 where there is no reading.
  [[nodiscard]] std::uint16_t fine_depth(std::uint16_t raw) const noexcept {
    return fine_[raw & 0x7ff];
  }
  /// Colour of each depth pixel; black where the colour camera does not see the point. Depth in
  /// counts of `mm_per_unit`. O(pixels).
  void color_of_depth(const std::uint16_t* depth, double mm_per_unit, const Rgb8* color, Rgb8* out);

 private:
  /// Index of the colour pixel, or -1.
  [[nodiscard]] int target_of(std::size_t pixel, unsigned depth_mm) const noexcept;

  double focal_px_ = 0.0;
  double baseline_m_ = 0.0;
  int start_lines_ = 0;
  std::array<std::uint16_t, 2048> fine_{};
  std::vector<std::int32_t> shift_;                 // by millimetre, 1/256 px
  std::vector<std::array<std::int32_t, 2>> table_;  // x in 1/256 px, y in px
  std::vector<std::int32_t> targets_;
  std::vector<std::uint16_t> nearest_;
};

}  // namespace grapnel
