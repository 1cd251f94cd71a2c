#pragma once

namespace grapnel::math {

// The C library's transcendental functions differ in the last bits between processors (it picks a
// variant at run time). These are plain IEEE arithmetic, so that the same input gives the same bits
// everywhere. Relative error below 4e-15 over the stated range unless noted.

[[nodiscard]] double sin(double x_rad) noexcept;          ///< |x| <= 1e6
[[nodiscard]] double cos(double x_rad) noexcept;          ///< |x| <= 1e6
[[nodiscard]] double atan2(double y, double x) noexcept;  ///< radians, -π…π; (0, 0) gives 0
[[nodiscard]] double acos(double x) noexcept;             ///< radians; x clamped to -1…1
[[nodiscard]] double exp(double x) noexcept;              ///< 0 below -708, saturates above 709
[[nodiscard]] double log(double x) noexcept;              ///< x > 0, else -infinity

inline constexpr double kPi = 3.14159265358979323846;

}  // namespace grapnel::math
