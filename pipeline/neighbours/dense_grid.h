#pragma once

#include <cstddef>
#include <span>

#include "base/arena.h"
#include "pipeline/kernels/window_nearest.h"
#include "pipeline/surface.h"

namespace grapnel {

/// An organised surface as dense planes with a border, for windows of pixels, and what a window
/// proves: how near a point outside of it can be.
class DenseGrid {
 public:
  void reserve(Arena& arena, int max_width, int max_height);
  /// False when the surface has no usable grid: no intrinsics, or points that do not project near
  /// their pixels. O(grid).
  [[nodiscard]] bool build(const Surface& surface) noexcept;

  [[nodiscard]] const kernels::PixelPlanes& planes() const noexcept { return planes_; }
  [[nodiscard]] std::ptrdiff_t at(int u, int v) const noexcept { return v * planes_.stride + u; }
  /// No point outside of the window of half-width `reach` around pixel (u, v) is nearer to that
  /// pixel's point, at depth `z_m`, than the root of this.
  [[nodiscard]] float least_outside_m2(int u, int v, float z_m, int reach) const noexcept;

 private:
  void copy_points(const Surface& surface) noexcept;

  std::span<float> x_, y_, z_;
  kernels::PixelPlanes planes_;
  float fx_ = 0.0F, fy_ = 0.0F, cx_ = 0.0F, cy_ = 0.0F;
  float slack_px_ = 0.0F;  // how far points lie from their pixels' centres
};

}  // namespace grapnel
