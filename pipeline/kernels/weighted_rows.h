#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace grapnel::kernels {

inline constexpr std::size_t kWeightedLength = 40;

/// Adds `row` (kWeightedLength elements) times weights[i] to the row `targets[i]` of a matrix whose
/// rows lie `stride` >= kWeightedLength elements apart.
void add_weighted_row(const float* row, std::span<const std::int32_t> targets, const float* weights,
                      std::size_t stride, float* matrix) noexcept;

}  // namespace grapnel::kernels
