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

/// Elements behind the last neighbour that select_rows() may read, and behind the last row it found
/// that it may write.
inline constexpr std::size_t kRowSlack = 8;

/// Of neighbours, each at a position and a distance², those that have a row (row_at[position] >= 0)
/// and do not lie at distance 0: their rows and their weights, one over the distance². Returns how
/// many.
std::size_t select_rows(std::span<const std::int32_t> position, const float* squared_m2,
                        const std::int32_t* row_at, std::int32_t* rows, float* weights) noexcept;

}  // namespace grapnel::kernels
