#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "base/arena.h"
#include "pipeline/features.h"

namespace grapnel {

/// The two nearest rows of another matrix, squared L2. -1 where there is none.
struct NearestTwo {
  std::int32_t best = -1;
  std::int32_t second = -1;
  float best_squared = 0.0F;
  float second_squared = 0.0F;
};

/// Rows of a feature matrix laid out for exhaustive search: blocks of eight rows, transposed.
/// A row of zeros (a keypoint that could not be described) is never found.
class NearestRows {
 public:
  static constexpr std::size_t kBlock = 8;

  void reserve(Arena& arena, std::size_t max_rows, std::size_t max_dimension);
  /// Copies the matrix; O(rows × dimension).
  void build(const FeatureMatrix& rows) noexcept;
  /// For each row of `queries` (same dimension) the two nearest rows, ties to the lower row. A
  /// query of zeros finds nothing. O(queries × rows × dimension).
  void find(const FeatureMatrix& queries, std::span<NearestTwo> found) const noexcept;

  [[nodiscard]] std::size_t rows() const noexcept { return rows_; }

 private:
  std::span<float> blocks_;  ///< block, then dimension, then row of the block
  std::span<float> bias_;    ///< 0, or infinity for a row that must not be found
  std::size_t rows_ = 0;
  std::size_t dimension_ = 0;
};

namespace kernels {

/// What nearest_two searches.
struct BlockedRows {
  const float* blocks = nullptr;
  const float* bias = nullptr;
  std::size_t block_count = 0;
  std::size_t dimension = 0;
};

/// The two nearest of the rows that stand at one place of their blocks, for each of the eight
/// places.
struct LaneBest {
  float best[NearestRows::kBlock];
  float second[NearestRows::kBlock];
  std::int32_t best_row[NearestRows::kBlock];
  std::int32_t second_row[NearestRows::kBlock];
};

/// The two nearest rows of up to four queries at once; `count` of them are real.
void nearest_two(const BlockedRows& rows, const float* const* queries, std::size_t count,
                 NearestTwo* found) noexcept;

inline constexpr std::size_t kQueriesAtOnce = 4;

}  // namespace kernels
}  // namespace grapnel
