#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "pipeline/kernels/within.h"

namespace grapnel::kernels {

/// A camera's grid spread out with a border, so that no window leaves it: one element a pixel.
/// A pixel without point holds kNowhere in x and zeros elsewhere.
struct DensePlanes {
  const float* x = nullptr;
  const float* y = nullptr;
  const float* z = nullptr;
  const float* nx = nullptr;
  const float* ny = nullptr;
  const float* nz = nullptr;
  const float* weight = nullptr;  ///< 1 where the pixel's point has a normal, else 0
  std::ptrdiff_t stride = 0;      ///< elements from a row to the next
};
/// Metres: farther from everything than any radius.
inline constexpr float kNowhere = 1e15F;

/// A window about a pixel: rows -half_height…half_height, row dv spans ±half_width[|dv|].
struct WindowShape {
  int half_height = 0;
  const std::int16_t* half_width = nullptr;
};

/// Pixels of one row that are worked on together; kBlock elements behind every window can be read.
inline constexpr int kBlock = 8;

/// Number, sums x, y, z and sums of products xx, xy, xz, yy, yz, zz.
inline constexpr int kWindowSums = 10;
/// Sums of the offsets to the points of a block's spheres (radius² squared_m2) over the window;
/// `at` is the index of the block's first pixel. x, y, z only where `first` is true, else zero.
/// Each pixel's sums run row by row: the same bits for every width of vector.
void window_scatter(const DensePlanes& planes, std::ptrdiff_t at, const WindowShape& window,
                    float squared_m2, bool first, float (*sums)[kBlock]) noexcept;

/// The same of the normals of the spheres' points that have one. `about` true: of the differences
/// to the pixel's own normal, which keeps the digits of a small spread.
void window_normals(const DensePlanes& planes, std::ptrdiff_t at, const WindowShape& window,
                    float squared_m2, bool about, float (*sums)[kBlock]) noexcept;

/// Normals in the order of a PointPlanes, with their weights and kSlack elements behind the last.
struct NormalPlanes {
  const float* x = nullptr;
  const float* y = nullptr;
  const float* z = nullptr;
  const float* weight = nullptr;
};

/// Whether any of the ranges' points in the sphere has a value above `own`. `values` in the order
/// of the points, with kSlack elements behind the last.
[[nodiscard]] bool exceeded_within(const PointPlanes& points, const float* values,
                                   std::span<const PointRange> ranges, const Sphere& sphere,
                                   float own) noexcept;

}  // namespace grapnel::kernels
