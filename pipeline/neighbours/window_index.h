#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "base/arena.h"
#include "pipeline/kernels/within.h"
#include "pipeline/surface.h"

namespace grapnel {

/// Radius windows on a camera's grid. Points are numbered row by row, so that a row of a window is
/// one stretch of consecutive points.
class WindowIndex {
 public:
  void reserve(Arena& arena, std::size_t max_grid_pixels);
  /// False when the surface has no usable grid: no intrinsics, points not in row order, or points
  /// that do not project near their pixels (a moved surface). O(n + grid).
  [[nodiscard]] bool build(const Surface& surface) noexcept;

  /// Rows of the window that holds every point within `radius_m` of `place`; row by row through
  /// `stretch`.
  struct Window {
    int left = 0, right = -1, top = 0, bottom = -1;  ///< inclusive
  };
  [[nodiscard]] Window window(const Vec3f& place, float radius_m) const noexcept {
    return window(place, place, radius_m);
  }
  /// The same of any place between two corners.
  [[nodiscard]] Window window(const Vec3f& low, const Vec3f& high, float radius_m) const noexcept;
  [[nodiscard]] PointRange stretch(const Window& window, int row) const noexcept {
    const std::int32_t* before = before_.data() + static_cast<std::ptrdiff_t>(row) * width_;
    return {before[window.left], before[window.right + 1]};
  }

  /// Largest distance of a point from its pixel's centre along a row or a column.
  [[nodiscard]] double slack_px() const noexcept { return static_cast<double>(slack_px_); }

 private:
  std::span<std::int32_t> before_;  ///< points before each pixel, row by row, one more at the end
  int width_ = 0;
  int height_ = 0;
  float fx_ = 0.0F, fy_ = 0.0F, cx_ = 0.0F, cy_ = 0.0F;
  float slack_px_ = 0.0F;  ///< how far points lie from their pixels' centres
};

}  // namespace grapnel
