#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "pipeline/kernels/block_sums.h"
#include "pipeline/kernels/pair_features.h"
#include "pipeline/kernels/weighted_rows.h"

namespace grapnel::kernels {

/// Points in the spheres of a block's points, in the ranges' order, with the distance² to each of
/// these; kOutside where a point does not lie in that one's sphere.
struct NearBlock {
  std::span<std::int32_t> position;       ///< room for them
  std::span<float> squared_m2;            ///< kBlock a position
  std::size_t size = 0;                   ///< found so far
  std::array<std::int32_t, kBlock> of{};  ///< of each of the block's points
};
inline constexpr float kOutside = -1.0F;

/// Adds what the ranges hold in the block's spheres (radius² squared_m2). False where there is no
/// room for it.
[[nodiscard]] bool add_near_block(const PointPlanes& points, const BlockOfPoints& block,
                                  std::span<const PointRange> ranges, float squared_m2,
                                  NearBlock& near) noexcept;

/// Counts of the bins of f1, f2 and f3, one after the other.
using PairBinCounts = std::array<std::uint32_t, 3 * kPairBins>;

/// Adds what pair_bins() gave for `count` pairs; it may read the eight entries behind them.
void count_bins(const std::int32_t* bins, std::size_t count, PairBinCounts& counts) noexcept;

/// Sets the counts of the pairs of each of a block's points with what is near it, as pair_bins()
/// and count_bins() give them. `bins`: room for kBlock entries a position of `near`.
void count_block_pairs(const float* points, const BlockOfPoints& block, const NearBlock& near,
                       std::span<std::int32_t> bins,
                       std::array<PairBinCounts, kBlock>& counts) noexcept;

/// A row for each of a block's points.
using BlockRows = std::array<std::array<float, kWeightedLength>, kBlock>;

/// Adds the block's rows, each over its distance² and in their order, to the row of every near
/// point that has one (row_at[position] >= 0), but its own: as add_weighted_row() and
/// select_rows().
void add_block_rows(const BlockRows& rows, const NearBlock& near, const std::int32_t* row_at,
                    std::size_t stride, float* matrix) noexcept;

}  // namespace grapnel::kernels
