#include "base/math.h"

#include <gtest/gtest.h>

#include <cmath>

namespace grapnel {
namespace {

// The stated bound of base/math.h, with room for the C library's own rounding.
constexpr double kRelative = 4e-15;

TEST(Math, AgreesWithTheCLibraryOverTheStatedRanges) {
  for (int i = -20000; i <= 20000; ++i) {
    const double x = static_cast<double>(i) * 0.00731;
    ASSERT_NEAR(math::sin(x), std::sin(x), kRelative) << x;
    ASSERT_NEAR(math::cos(x), std::cos(x), kRelative) << x;
    ASSERT_NEAR(math::exp(x), std::exp(x), kRelative * std::exp(x)) << x;
    const double positive = std::exp(x / 3.0);
    ASSERT_NEAR(math::log(positive), std::log(positive), kRelative * (1.0 + std::fabs(x))) << x;
    const double y = static_cast<double>(i % 317) * 0.01 - 1.5;
    ASSERT_NEAR(math::atan2(y, x), std::atan2(y, x), kRelative) << y << " " << x;
    const double c = static_cast<double>(i) / 20000.0;
    ASSERT_NEAR(math::acos(c), std::acos(c), 4.0 * kRelative) << c;
  }
}

TEST(Math, KeepsTheSignOfTheQuadrant) {
  EXPECT_DOUBLE_EQ(math::atan2(0.0, -1.0), math::kPi);
  EXPECT_DOUBLE_EQ(math::atan2(-1.0, 0.0), -0.5 * math::kPi);
  EXPECT_EQ(math::atan2(0.0, 0.0), 0.0);
}

}  // namespace
}  // namespace grapnel
