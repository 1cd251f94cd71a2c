#pragma once

#include <cstddef>
#include <cstdint>

namespace grapnel::kernels {

/// What is summed over the elements of two rows; smaller sums are nearer.
enum class RowScore : std::uint8_t {
  SquaredDifference,
  Difference,  ///< absolute
  LargestDifference,
  RootOfDifference,
  ChiSquare,  ///< (a - b)² / (a + b), 0 for 0/0
  Product,    ///< negated
  Least,      ///< the smaller of the two, negated
};

inline constexpr std::size_t kRowsInBlock = 8;
inline constexpr std::size_t kQueriesAtOnce = 4;

/// Rows to be searched: blocks of eight, transposed (block, then element, then row of the block).
struct RowBlocks {
  const float* blocks = nullptr;
  const float* bias = nullptr;  ///< of each row: 0, or infinity for one that must not be found
  std::size_t block_count = 0;
  std::size_t length = 0;
};

struct BestRow {
  float score = 0.0F;
  std::int32_t row = -1;  ///< -1: none
};

/// Offers every row to `count` (1…4) queries' lists of the `kept` best, best first, ties to the
/// lower row. The lists come in as they are to be continued: infinity and -1 at first.
void best_rows(RowScore score, const RowBlocks& rows, const float* const* queries,
               std::size_t count, std::size_t kept, BestRow* const* best) noexcept;

}  // namespace grapnel::kernels
