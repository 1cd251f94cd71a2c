#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "pipeline/kernels/block_sums.h"

namespace grapnel::kernels {

inline constexpr std::size_t kMaxPerOctave = 5;
inline constexpr std::size_t kMaxScales = kMaxPerOctave + 3;

/// Gaussians of growing width, each cut at three sigma: per_octave + 3 of them, and scale
/// i + per_octave is twice scale i.
struct GaussianScales {
  std::size_t per_octave = 1;                 ///< 1…kMaxPerOctave
  std::array<float, kMaxScales> reach_m2{};   ///< 9 sigma²
  std::array<float, kMaxScales> eighth_m2{};  ///< 1 / (16 sigma²)
  [[nodiscard]] std::size_t count() const noexcept { return per_octave + 3; }
};

/// Means of `values` (in the order of the points) around a block's points, a row a scale, over the
/// ranges' points within three sigma: weights exp(-d² / (2 sigma²)), right to 1e-6. They run
/// through the ranges in order: the same bits for every width of vector.
void gaussian_means(const PointPlanes& points, const float* values, const BlockOfPoints& block,
                    std::span<const PointRange> ranges, const GaussianScales& scales,
                    float (*means)[kBlock]) noexcept;

}  // namespace grapnel::kernels
