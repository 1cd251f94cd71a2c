#include "pipeline/neighbours/widest_gap.h"

#include <algorithm>

#include "base/math.h"

namespace grapnel {

double widest_gap_rad(const Surface& surface, std::size_t point_i, const Neighbourhood& around,
                      std::span<float> angles) noexcept {
  const Vec3d normal = surface.normal(point_i).cast<double>();
  const Vec3d v = normal.unitOrthogonal();
  const Vec3d u = normal.cross(v);
  std::size_t count = 0;
  for (const std::int32_t index : around.index) {
    const Vec3d d =
        (surface.point(static_cast<std::size_t>(index)) - surface.point(point_i)).cast<double>();
    if (d.isZero(0.0)) continue;
    angles[count++] = static_cast<float>(math::atan2(v.dot(d), u.dot(d)));
  }
  if (count == 0) return 0.0;
  std::sort(angles.begin(), angles.begin() + static_cast<std::ptrdiff_t>(count));
  double widest =
      2.0 * math::kPi - static_cast<double>(angles[count - 1]) + static_cast<double>(angles[0]);
  for (std::size_t i = 1; i < count; ++i) {
    widest = std::max(widest, static_cast<double>(angles[i]) - static_cast<double>(angles[i - 1]));
  }
  return widest;
}

}  // namespace grapnel
