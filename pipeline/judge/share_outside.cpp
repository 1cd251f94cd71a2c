#include "pipeline/judge/share_outside.h"

#include <cstddef>

namespace grapnel {

double share_outside(const Surface& model, const Pose& camera_from_model,
                     const Intrinsics& camera) noexcept {
  const Eigen::Matrix3f rotation = camera_from_model.linear().cast<float>();
  const Vec3f shift = camera_from_model.translation().cast<float>();
  std::size_t facing = 0;
  std::size_t outside = 0;
  for (std::size_t i = 0; i < model.size; ++i) {
    const Vec3f p = rotation * model.point(i) + shift;
    if ((rotation * model.normal(i)).dot(p) >= 0.0F) continue;
    ++facing;
    const double u = camera.fx * static_cast<double>(p.x() / p.z()) + camera.cx;
    const double v = camera.fy * static_cast<double>(p.y() / p.z()) + camera.cy;
    const bool inside =
        p.z() > 0.0F && u >= 0.0 && v >= 0.0 && u <= camera.width - 1.0 && v <= camera.height - 1.0;
    if (!inside) ++outside;
  }
  return facing > 0 ? static_cast<double>(outside) / static_cast<double>(facing) : 1.0;
}

}  // namespace grapnel
