#include "pipeline/judge/resting.h"

#include <algorithm>
#include <array>
#include <cstddef>

namespace grapnel {
namespace {

constexpr double kBandOfDiameter = 0.02;

// Cosine and sine of multiples of 22.5 degrees, the first quarter.
constexpr std::array<std::array<double, 2>, 4> kQuarter = {
    {{1.0, 0.0},
     {0.92387953251128674, 0.38268343236508978},
     {0.70710678118654752, 0.70710678118654752},
     {0.38268343236508978, 0.92387953251128674}}};

}  // namespace

Resting rest_on(const DepthPlane& plane, const Surface& model, const Pose& camera_from_model,
                const Vec3d& centre, double diameter_m) noexcept {
  // Heights and places along the plane, both in the model's own frame.
  const Vec3d up = camera_from_model.linear().transpose() * plane.normal;
  const double offset_m = plane.normal.dot(camera_from_model.translation()) + plane.offset_m;
  const Vec3d along = up.unitOrthogonal();
  const Vec3d across = up.cross(along);
  Resting resting;
  resting.lowest_m = 1e9;
  resting.highest_m = -1e9;
  for (std::size_t i = 0; i < model.size; ++i) {
    const double height_m = up.dot(model.point(i).cast<double>()) + offset_m;
    resting.lowest_m = std::min(resting.lowest_m, height_m);
    resting.highest_m = std::max(resting.highest_m, height_m);
  }
  const double band_m = resting.lowest_m + kBandOfDiameter * diameter_m;
  std::array<double, 16> reach_m;
  reach_m.fill(-1e9);
  for (std::size_t i = 0; i < model.size; ++i) {
    const Vec3d p = model.point(i).cast<double>();
    if (up.dot(p) + offset_m > band_m) continue;
    const double x = along.dot(p - centre);
    const double y = across.dot(p - centre);
    for (std::size_t k = 0; k < kQuarter.size(); ++k) {
      const double forward = kQuarter[k][0] * x + kQuarter[k][1] * y;
      const double aside = kQuarter[k][0] * y - kQuarter[k][1] * x;
      reach_m[k] = std::max(reach_m[k], forward);
      reach_m[k + 4] = std::max(reach_m[k + 4], aside);
      reach_m[k + 8] = std::max(reach_m[k + 8], -forward);
      reach_m[k + 12] = std::max(reach_m[k + 12], -aside);
    }
  }
  resting.support_m = *std::min_element(reach_m.begin(), reach_m.end());
  return resting;
}

}  // namespace grapnel
