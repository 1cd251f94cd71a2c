#pragma once

#include <cstddef>

namespace grapnel::kernels {

/// Columns that are worked on together.
inline constexpr std::size_t kStrip = 64;
/// Half-width of the largest window, pixels.
inline constexpr int kMaxPlaneReach = 6;

/// Sums over the pixels up to a reach left and right of each of a strip's pixels: how many have a
/// reading, of their offsets and these squared, of their inverse depths, these squared and times
/// offsets; and the least and the most inverse depth.
struct RowSums {
  alignas(64) float count[kStrip];
  alignas(64) float offset[kStrip];
  alignas(64) float square[kStrip];
  alignas(64) float inverse[kStrip];
  alignas(64) float energy[kStrip];
  alignas(64) float moment[kStrip];
  alignas(64) float least[kStrip];
  alignas(64) float most[kStrip];
};

/// Of the strip that begins at `inverse_m`: 1/z, 0 = no reading; readable `reach` elements before,
/// and eight more than that behind.
void sum_row(const float* inverse_m, int reach, RowSums& sums) noexcept;

/// Where a row of a strip lies in its image.
struct StripPlace {
  float first_u = 0.0F;  ///< of its first pixel, from the principal point
  float v = 0.0F;
  float fx = 0.0F, fy = 0.0F;  ///< all in these pixels
  float max_span = 0.0F;       ///< of a window's inverse depths, over the pixel's own
  float max_off = 0.0F;        ///< root mean square off the plane, over the pixel's own
};

/// Normals, toward the camera, of the planes that fit the readings of each pixel's window best:
/// rows -reach…reach, each as sum_row() left it, whose middle one begins at `inverse_m`. Zero where
/// the pixel has no reading, the window holds more than one surface, or its readings lie almost on
/// a line. A plane's inverse depth is affine in the pixel, so readings may be missing.
void fit_window_planes(const RowSums* const* rows, int reach, const float* inverse_m,
                       const StripPlace& place, float* nx, float* ny, float* nz) noexcept;

}  // namespace grapnel::kernels
