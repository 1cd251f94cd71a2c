#pragma once

#include <cstdint>

#include "pipeline/stage.h"

namespace grapnel {

/// Partners in a camera's view by projection: the nearest of the points at the pixel that a point
/// falls on and around it (Blais and Levine 1995). No index to build. A partner farther to the side
/// than the window is not found.
class ClosestInView final : public ClosestSurface {
 public:
  /// `view` is organised, has its camera in its own origin, and must stay where it is. Errors:
  /// BadParameter (no grid).
  [[nodiscard]] Status build(const Surface& view, int half_window_px) noexcept;

  [[nodiscard]] std::int32_t closest(const Vec3f& p, float max_distance_m) const noexcept override;

 private:
  const Surface* view_ = nullptr;
  int half_ = 1;
  float fx_ = 0.0F, fy_ = 0.0F, cx_ = 0.0F, cy_ = 0.0F;
};

}  // namespace grapnel
