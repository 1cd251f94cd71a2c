#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace grapnel::kernels {

inline constexpr std::size_t kMaxScales = 8;

/// Gaussians of growing width, each cut at three sigma.
struct GaussianScales {
  std::size_t count = 0;
  std::size_t per_octave = 1;                  ///< scale i + per_octave is twice scale i
  std::array<float, kMaxScales> reach_m2{};    ///< 9 sigma²
  std::array<float, kMaxScales> inverse_m2{};  ///< 1 / (2 sigma²)
};

/// Weighted sums of values and the weights' sums, one a scale.
struct GaussianSums {
  std::array<float, kMaxScales> weighted{};
  std::array<float, kMaxScales> weight{};
};

/// Over the neighbours `index` (with kSlack of within.h elements behind, as the distances) of a
/// place: weight exp(-d² / (2 sigma²)) within three sigma. Position modulo eight adds up first: the
/// same bits for every width of vector. Weights are right to 1e-6.
[[nodiscard]] GaussianSums gaussian_sums(std::span<const std::int32_t> index,
                                         const float* squared_m2, const float* values,
                                         const GaussianScales& scales) noexcept;

}  // namespace grapnel::kernels
