#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace grapnel::kernels {

/// Points with normals.
struct OrientedPlanes {
  const float* x = nullptr;
  const float* y = nullptr;
  const float* z = nullptr;
  const float* nx = nullptr;
  const float* ny = nullptr;
  const float* nz = nullptr;
};

inline constexpr int kPairBins = 11;  ///< of each of the three features
/// A pair without features: coincident points, or the line between them along the normal. No byte
/// of it is a bin.
inline constexpr std::int32_t kNoPair = kPairBins * 0x010101;

/// Elements of a point stored as one row: x, y, z, nx, ny, nz and two unused. Eight scattered rows
/// are faster to fetch than six elements each from eight places of six planes.
inline constexpr std::size_t kOrientedRow = 8;

/// Bins of the three angular pair features (Rusu 2009, eq. 3; PCL's computePairFeatures) between
/// point `point_i` and each of `others`: f1 bin | f2 bin << 8 | f3 bin << 16, or kNoPair. f1 is the
/// angle about v, f2 and f3 are cosines. `points` are rows of kOrientedRow; `bins` holds
/// others.size() + 8 entries, and behind the last up to seven become kNoPair.
void pair_bins(const float* points, std::int32_t point_i, std::span<const std::int32_t> others,
               std::int32_t* bins) noexcept;

inline constexpr std::size_t kPairCellTables = 4;
/// Counts of pairs by cell; the sum of the four tables is the count. Each has a place for the pairs
/// without features behind its cells.
struct PairCellCounts {
  std::uint32_t* table[kPairCellTables] = {};
};

/// Counts every pair of the first `count` points in the cell of its three features, `bins` each:
/// f1 bin + bins (f2 bin + bins f3 bin). The later point of a pair stands first. The planes hold 8
/// readable elements behind the last point.
void count_pair_cells(const OrientedPlanes& points, std::size_t count, int bins,
                      const PairCellCounts& counts) noexcept;

}  // namespace grapnel::kernels
