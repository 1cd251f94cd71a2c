#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "base/arena.h"
#include "base/geometry.h"

namespace grapnel {

/// A sampled surface: points with normals, structure of arrays, in memory that somebody else owns.
/// From a camera it keeps its grid (one point a pixel of the decimated image); a cloud has none.
struct Surface {
  std::span<float> x, y, z;     ///< metres, `size` valid elements each
  std::span<float> nx, ny, nz;  ///< unit normals; all zero = no normal
  std::span<float> intensity;   ///< 0…1; 0 where unknown
  std::size_t size = 0;

  /// Working grid; width 0 = none. Pixel (u, v) of the grid has index v * width + u.
  struct Grid {
    int width = 0;
    int height = 0;
    Intrinsics intrinsics;             ///< of the grid (already divided by the stride)
    std::span<std::int32_t> point_of;  ///< pixel → point, -1 = none
    std::span<std::int32_t> pixel_of;  ///< point → pixel
  } grid;

  /// Where the points were seen from, in their own frame; normals point toward it. Unset for a
  /// fused model.
  Vec3f viewpoint = Vec3f::Zero();
  bool has_viewpoint = false;
  /// Distance between neighbouring samples, metres: what radii given in multiples refer to.
  double spacing_m = 0.0;

  [[nodiscard]] bool organised() const noexcept { return grid.width > 0; }
  [[nodiscard]] std::size_t capacity() const noexcept { return x.size(); }
  [[nodiscard]] Vec3f point(std::size_t i) const noexcept { return {x[i], y[i], z[i]}; }
  [[nodiscard]] Vec3f normal(std::size_t i) const noexcept { return {nx[i], ny[i], nz[i]}; }
  [[nodiscard]] bool has_normal(std::size_t i) const noexcept {
    return nx[i] != 0.0F || ny[i] != 0.0F || nz[i] != 0.0F;
  }

  /// Whether every coordinate is a number. O(n).
  [[nodiscard]] bool all_finite() const noexcept;

  /// Memory for `max_points` and, where `max_grid_pixels` > 0, a grid.
  void reserve(Arena& arena, std::size_t max_points, std::size_t max_grid_pixels);
  void clear() noexcept;
};

/// Mean of all points; zero without any. O(n).
[[nodiscard]] Vec3d centroid(const Surface& surface) noexcept;

/// Hash of all points and normals. O(n).
[[nodiscard]] std::uint64_t hash_points(const Surface& surface) noexcept;

}  // namespace grapnel
