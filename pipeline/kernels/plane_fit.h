#pragma once

#include <cstddef>

#include "pipeline/kernels/moved.h"

namespace grapnel::kernels {

/// Half-width of the window that a plane is fitted to, pixels.
inline constexpr int kFitReach = 2;

/// A row of inverse depths and where it lies. The inverse depth of a plane is affine in the pixel.
struct FitRow {
  const float* inverse_m = nullptr;  ///< 1/z of the row's first pixel; 0 = no reading. Readable:
                                     ///< kFitReach rows and pixels around, kLanes behind
  std::ptrdiff_t stride = 0;         ///< elements from row to row
  float first_u = 0.0F;              ///< of the first pixel, from the principal point
  float v = 0.0F;
  float fx = 0.0F, fy = 0.0F;
  float max_step = 0.0F;  ///< largest span of the inverse depths of a window, over their mean
};

/// Normals, toward the camera, of the planes through the windows of `count` pixels; zero where a
/// window lacks a reading or spans a step. The outputs hold in_lanes(count) elements.
void fit_planes(const FitRow& row, std::size_t count, float* nx, float* ny, float* nz) noexcept;

}  // namespace grapnel::kernels
