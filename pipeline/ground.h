#pragma once

#include "base/geometry.h"

namespace grapnel {

/// The plane that objects stand on: n·p + offset = 0 in the camera's frame, n toward the objects.
struct Ground {
  Vec3d normal = Vec3d::Zero();  ///< unit; zero = none is known
  double offset_m = 0.0;

  [[nodiscard]] bool known() const noexcept { return normal.squaredNorm() > 0.5; }
  /// Above the plane, metres.
  [[nodiscard]] double height_m(const Vec3d& p) const noexcept { return normal.dot(p) + offset_m; }
};

}  // namespace grapnel
