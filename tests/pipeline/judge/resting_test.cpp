#include "pipeline/judge/resting.h"

#include <gtest/gtest.h>

#include <vector>

#include "base/math.h"

namespace grapnel {
namespace {

constexpr double kPi = 3.14159265358979323846;

/// Points of a box's six faces, 10 mm apart, about its centre.
class BoxPoints {
 public:
  explicit BoxPoints(const Vec3d& half_m) {
    for (int axis = 0; axis < 3; ++axis) {
      const int b = (axis + 1) % 3;
      const int c = (axis + 2) % 3;
      for (double s = -half_m[b]; s <= half_m[b] + 1e-9; s += 0.01) {
        for (double t = -half_m[c]; t <= half_m[c] + 1e-9; t += 0.01) {
          for (const double side : {-1.0, 1.0}) {
            Vec3d p;
            p[axis] = side * half_m[axis];
            p[b] = s;
            p[c] = t;
            x_.push_back(static_cast<float>(p.x()));
            y_.push_back(static_cast<float>(p.y()));
            z_.push_back(static_cast<float>(p.z()));
          }
        }
      }
    }
    surface_.x = x_;
    surface_.y = y_;
    surface_.z = z_;
    surface_.size = x_.size();
  }
  [[nodiscard]] const Surface& surface() const { return surface_; }

 private:
  std::vector<float> x_, y_, z_;
  Surface surface_;
};

/// The belt one metre before a camera that looks straight down.
DepthPlane belt() {
  DepthPlane plane;
  plane.normal = {0.0, 0.0, -1.0};
  plane.offset_m = 1.0;
  return plane;
}

/// A box of 0.4 × 0.3 × 0.2 m, turned about the camera's x axis, its lowest point `gap_m` above the
/// belt.
Resting rest_box(double turn_rad, double gap_m) {
  const Vec3d half_m(0.2, 0.15, 0.1);
  const BoxPoints box(half_m);
  const double s = math::sin(turn_rad);
  const double c = math::cos(turn_rad);
  Pose pose = Pose::Identity();
  pose.linear() << 1.0, 0.0, 0.0, 0.0, c, -s, 0.0, s, c;
  const double reach_m = half_m.y() * std::abs(s) + half_m.z() * std::abs(c);
  pose.translation() = Vec3d(0.03, -0.02, 1.0 - gap_m - reach_m);
  return rest_on(belt(), box.surface(), pose, Vec3d::Zero(), 2.0 * half_m.norm());
}

TEST(Resting, ABoxOnAFaceStandsByHalfItsShorterSide) {
  const Resting resting = rest_box(0.0, 0.004);
  EXPECT_NEAR(resting.lowest_m, 0.004, 1e-6);
  // Sixteen directions: the hull's nearest side is met exactly.
  EXPECT_NEAR(resting.support_m, 0.15, 1e-6);
}

TEST(Resting, ABoxOnAnotherFaceStandsToo) {
  EXPECT_NEAR(rest_box(kPi / 2.0, 0.0).support_m, 0.1, 1e-6);
  EXPECT_GT(rest_box(kPi, 0.0).support_m, 0.1);
}

TEST(Resting, AFewDegreesOfErrorDoNotTip) { EXPECT_GT(rest_box(0.05, 0.0).support_m, 0.0); }

TEST(Resting, ABoxLeaningOnAnEdgeTips) {
  for (const double turn : {0.25, -0.25, 0.6, kPi / 2.0 - 0.3}) {
    EXPECT_LT(rest_box(turn, 0.0).support_m, 0.0) << turn;
  }
}

}  // namespace
}  // namespace grapnel
