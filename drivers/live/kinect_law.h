#pragma once

namespace grapnel {

/// Factory constants of a Kinect v1's triangulation.
struct KinectConstants {
  double reference_distance_mm = 120.0;  ///< to the factory's plane, in the unit's own measure
  double reference_pixel_mm = 0.1042;    ///< of the full 1280-pixel image
  double emitter_distance_cm = 7.5;      ///< projector to infrared camera
  double const_shift = 200.0;
};

/// libfreenect's law (registration.c, freenect_raw_to_mm) without its rounding to millimetres:
/// eight steps of disparity to a pixel of the full image. Not positive where there is no depth.
[[nodiscard]] constexpr double kinect_depth_mm(int raw, const KinectConstants& unit) noexcept {
  const double shift_px = (raw - 4.0 * unit.const_shift) / 4.0 - 0.375;
  const double metric = shift_px * unit.reference_pixel_mm;
  return 10.0 * (metric * unit.reference_distance_mm / (unit.emitter_distance_cm - metric) +
                 unit.reference_distance_mm);
}

/// Raw value of a Kinect's pixel without reading.
inline constexpr int kKinectNoReading = 2047;
/// Finer than the sensor's steps from 0.4 m on, and still 13 m in 16 bits.
inline constexpr double kKinectFineUnit_m = 0.0002;

}  // namespace grapnel
