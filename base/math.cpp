#include "base/math.h"

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

namespace grapnel::math {
namespace {

// π/2 in three parts whose leading ones have trailing zero bits, so that k * part is exact for
// |k| < 2^20 (Cody and Waite 1980, ch. 8).
constexpr double kHalfPiHigh = 0x1.921fb544p+0;
constexpr double kHalfPiMid = 0x1.0b4611a6p-34;
constexpr double kHalfPiLow = 0x1.3198a2e037073p-69;
constexpr double kTwoOverPi = 0.63661977236758134308;

struct Reduced {
  double r;      // in -π/4…π/4
  int quadrant;  // 0…3
};

Reduced reduce(double x) noexcept {
  const double k = std::nearbyint(x * kTwoOverPi);
  double r = x - k * kHalfPiHigh;
  r -= k * kHalfPiMid;
  r -= k * kHalfPiLow;
  const auto quadrant = static_cast<int>(static_cast<std::int64_t>(k) & 3);
  return {r, quadrant};
}

// Taylor series: at |r| <= π/4 the first term left out is below 2^-53 of the sum.
double sin_poly(double r) noexcept {
  const double s = r * r;
  double p = -1.0 / 1307674368000.0;
  p = p * s + 1.0 / 6227020800.0;
  p = p * s - 1.0 / 39916800.0;
  p = p * s + 1.0 / 362880.0;
  p = p * s - 1.0 / 5040.0;
  p = p * s + 1.0 / 120.0;
  p = p * s - 1.0 / 6.0;
  return r + r * s * p;
}

double cos_poly(double r) noexcept {
  const double s = r * r;
  double p = 1.0 / 20922789888000.0;
  p = p * s - 1.0 / 87178291200.0;
  p = p * s + 1.0 / 479001600.0;
  p = p * s - 1.0 / 3628800.0;
  p = p * s + 1.0 / 40320.0;
  p = p * s - 1.0 / 720.0;
  p = p * s + 1.0 / 24.0;
  return 1.0 - 0.5 * s + s * s * p;
}

// atan on 0…tan(π/16) by series, after two angle halvings: atan(t) = 2 atan(t / (1 + sqrt(1 +
// t²))).
double atan_unit(double t) noexcept {
  double factor = 1.0;
  for (int i = 0; i < 3; ++i) {
    t = t / (1.0 + std::sqrt(1.0 + t * t));
    factor *= 2.0;
  }
  const double s = t * t;  // t <= tan(π/32) = 0.0985
  double p = 1.0 / 17.0;
  p = p * s - 1.0 / 15.0;
  p = p * s + 1.0 / 13.0;
  p = p * s - 1.0 / 11.0;
  p = p * s + 1.0 / 9.0;
  p = p * s - 1.0 / 7.0;
  p = p * s + 1.0 / 5.0;
  p = p * s - 1.0 / 3.0;
  return factor * (t + t * s * p);
}

}  // namespace

double sin(double x_rad) noexcept {
  const Reduced reduced = reduce(x_rad);
  const double value = (reduced.quadrant & 1) != 0 ? cos_poly(reduced.r) : sin_poly(reduced.r);
  return (reduced.quadrant & 2) != 0 ? -value : value;
}

double cos(double x_rad) noexcept {
  const Reduced reduced = reduce(x_rad);
  const double value = (reduced.quadrant & 1) != 0 ? sin_poly(reduced.r) : cos_poly(reduced.r);
  const bool negative = reduced.quadrant == 1 || reduced.quadrant == 2;
  return negative ? -value : value;
}

double atan2(double y, double x) noexcept {
  const double ax = std::fabs(x);
  const double ay = std::fabs(y);
  if (ax == 0.0 && ay == 0.0) return 0.0;
  const bool steep = ay > ax;
  const double angle_first = atan_unit(steep ? ax / ay : ay / ax);
  double angle = steep ? 0.5 * kPi - angle_first : angle_first;
  if (std::signbit(x)) angle = kPi - angle;
  return std::signbit(y) ? -angle : angle;
}

double acos(double x) noexcept {
  const double c = x < -1.0 ? -1.0 : (x > 1.0 ? 1.0 : x);
  return atan2(std::sqrt((1.0 - c) * (1.0 + c)), c);
}

double exp(double x) noexcept {
  if (x < -708.0) return 0.0;
  if (x > 709.0) return std::numeric_limits<double>::max();
  constexpr double kLn2High = 0x1.62e42feep-1;
  constexpr double kLn2Low = 0x1.a39ef35793c76p-33;
  const double k = std::nearbyint(x * 1.44269504088896340736);
  const double r = (x - k * kLn2High) - k * kLn2Low;  // |r| <= 0.3466
  double p = 1.0;
  for (int n = 14; n >= 1; --n) p = 1.0 + p * r / static_cast<double>(n);
  const auto exponent = static_cast<std::uint64_t>(static_cast<std::int64_t>(k) + 1023);
  return p * std::bit_cast<double>(exponent << 52);
}

double log(double x) noexcept {
  if (!(x > 0.0)) return -std::numeric_limits<double>::infinity();
  int exponent = 0;
  double m = std::frexp(x, &exponent);  // 0.5…1
  if (m < 0.70710678118654752440) {
    m *= 2.0;
    exponent -= 1;
  }
  const double t = (m - 1.0) / (m + 1.0);  // |t| <= 0.1716
  const double s = t * t;
  double p = 0.0;
  for (int n = 23; n >= 3; n -= 2) p = (p + 1.0 / static_cast<double>(n)) * s;
  return 2.0 * (t + t * p) + static_cast<double>(exponent) * 0.69314718055994530942;
}

}  // namespace grapnel::math
