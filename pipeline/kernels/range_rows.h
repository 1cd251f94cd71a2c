#pragma once

#include <cstddef>
#include <cstdint>

#include "pipeline/kernels/eigenvectors.h"

namespace grapnel::kernels {

// Neighbourhoods of fixed shape in a range image, kRangeBlock pixels of a row at a time, each pixel
// by itself: the same bits for every width of vector. A pixel without coordinates holds at least
// 1e15 in x and zeros in y and z.

inline constexpr int kRangeBlock = 16;
/// Pixels around a block that are read.
inline constexpr int kRangeReach = 3;

/// Ninth smallest squared distance of a patch from which on it has fewer than nine pixels.
inline constexpr float kTooFew_m2 = 1e29F;

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

/// Of the 5 × 5 pixels about each: the ninth smallest squared distance (kTooFew_m2 and more
/// where there are fewer), and mean and covariance of the offsets to those at most twice that far.
void fit_patches(const RangePlanes& image, std::ptrdiff_t at, float* ninth_m2,
                 const Spread& out) noexcept;

/// Turns a block's normals toward the camera, in place; `reach_m2` (see fit_patches) of pixels
/// without coordinates becomes -1. Returns a bit for each pixel with coordinates that has no plane
/// yet: its normal is zero, or it has fewer than nine pixels around it.
[[nodiscard]] std::uint32_t face_camera(const RangePlanes& image, std::ptrdiff_t at,
                                        const VectorPlanes& normals, float* reach_m2) noexcept;

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

/// Pulls a block's scores toward the mean of the eight around each, where that can lift them to
/// `least` and both have the same sign.
void smooth_scores(const float* scores, std::ptrdiff_t at, std::ptrdiff_t stride, float least,
                   float* out) noexcept;

/// Covariance of the normals along eight beams of two pixels, as differences to each pixel's own.
/// `code`: 1 a normal to count, 0 none, -1 the beam ends. `count` receives how many there were.
void beam_spread(const RangePlanes& normals, const float* code, std::ptrdiff_t at, float* count,
                 const Spread& out) noexcept;

}  // namespace grapnel::kernels
