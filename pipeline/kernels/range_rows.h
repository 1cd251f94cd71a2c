#pragma once

#include <cstddef>

#include "pipeline/kernels/eigenvalues.h"

namespace grapnel::kernels {

// Neighbourhoods of fixed shape in a range image, kRangeBlock pixels of a row at a time, each pixel
// by itself: the same bits for every width of vector. A pixel without coordinates holds at least
// 1e15 in x and zeros in y and z.

inline constexpr int kRangeBlock = 16;
/// Pixels around a block that are read.
inline constexpr int kRangeReach = 3;

/// Planes of a range image; `at` arguments below index a block's first pixel.
struct RangePlanes {
  const float* x = nullptr;
  const float* y = nullptr;
  const float* z = nullptr;
  std::ptrdiff_t stride = 0;  ///< elements from a row to the next
};

/// Where a block's results go, kRangeBlock elements each.
struct Spread {
  float *xx = nullptr, *xy = nullptr, *xz = nullptr, *yy = nullptr, *yz = nullptr, *zz = nullptr;
  float *mean_x = nullptr, *mean_y = nullptr, *mean_z = nullptr;
};

/// Of the 5 × 5 pixels about each: the ninth smallest squared distance (1e29 and more where there
/// are fewer), and mean and covariance of the offsets to those at most twice that far.
void fit_patches(const RangePlanes& image, std::ptrdiff_t at, float* ninth_m2,
                 const Spread& out) noexcept;

/// Values of a block's pixels besides their place.
struct JumpPlanes {
  const float* range = nullptr;
  const float* reach_m2 = nullptr;  ///< squared distance that is the same surface; < 0: no surface
};
/// How far the mean of the three pixels `step` elements apart jumps away from each pixel, -1…1:
/// 1 - reach / distance, negative toward the camera; 0 within its reach, 1 where the first of the
/// three is far (x of 2e15).
void jumps(const RangePlanes& image, const JumpPlanes& planes, std::ptrdiff_t at,
           std::ptrdiff_t step, float* out) noexcept;

/// Covariance of the normals along eight beams of two pixels, as differences to each pixel's own.
/// `code`: 1 a normal to count, 0 none, -1 the beam ends. `count` receives how many there were.
void beam_spread(const RangePlanes& normals, const float* code, std::ptrdiff_t at, float* count,
                 const Spread& out) noexcept;

}  // namespace grapnel::kernels
