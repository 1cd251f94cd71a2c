#include "tests/contract/hills.h"

#include "base/math.h"

namespace grapnel::test {
namespace {

/// A sheet 0.4 m wide with hills that fit on each other in one way only.
double height_m(double x, double y) {
  constexpr double kHills[6][4] = {{-0.12, -0.08, 0.05, 0.055}, {0.10, -0.11, -0.04, 0.05},
                                   {0.03, 0.02, 0.06, 0.045},   {-0.10, 0.12, -0.035, 0.05},
                                   {0.13, 0.09, 0.045, 0.04},   {-0.02, -0.16, 0.03, 0.03}};
  double height = 0.0;
  for (const auto& [hill_x, hill_y, size, width] : kHills) {
    const double square = (x - hill_x) * (x - hill_x) + (y - hill_y) * (y - hill_y);
    height += size * math::exp(-square / (2.0 * width * width));
  }
  return height;
}

}  // namespace

test::OwnedSurface sheet(int side, double turn_rad, const Pose& pose) {
  test::OwnedSurface surface(static_cast<std::size_t>(side * side), 0);
  const double c = math::cos(turn_rad);
  const double s = math::sin(turn_rad);
  for (int row = 0; row < side; ++row) {
    for (int column = 0; column < side; ++column) {
      const double u = 0.5 * (static_cast<double>(column) / (side - 1) - 0.5);
      const double v = 0.5 * (static_cast<double>(row) / (side - 1) - 0.5);
      const double x = c * u - s * v;
      const double y = s * u + c * v;
      if (x * x > 0.04 || y * y > 0.04) continue;
      const std::size_t i = surface->size++;
      const Vec3f p = (pose * Vec3d(x, y, height_m(x, y))).cast<float>();
      surface->x[i] = p.x();
      surface->y[i] = p.y();
      surface->z[i] = p.z();
      surface->intensity[i] =
          static_cast<float>(0.5 + 0.25 * math::sin(40.0 * x) + 0.25 * math::sin(55.0 * y));
    }
  }
  surface->viewpoint = (pose * Vec3d(0.0, 0.0, 1.0)).cast<float>();
  surface->has_viewpoint = true;
  return surface;
}

Pose truth_of_pair() {
  Pose pose = Pose::Identity();
  pose.linear() = rotation_from_vector(Vec3d(0.2, -0.15, 0.6));
  pose.translation() = Vec3d(0.1, -0.05, 0.2);
  return pose;
}

}  // namespace grapnel::test
