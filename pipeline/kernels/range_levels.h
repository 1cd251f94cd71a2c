#pragma once

#include <cstddef>
#include <cstdint>

#include "pipeline/kernels/range_rows.h"

namespace grapnel::kernels {

/// Distances of `count` pixels from the camera, 0 without coordinates; lowers `nearest` and raises
/// `farthest` to theirs. Up to kRangeBlock elements behind the last are read and set to 0.
void ranges(const RangePlanes& row, std::ptrdiff_t count, float* range, float* nearest,
            float* farthest) noexcept;

/// Pixels of a row: place, range and point; x of what was not observed holds 1e15, of what is far
/// 2e15.
struct RangeRow {
  const float *x = nullptr, *y = nullptr, *z = nullptr, *range = nullptr;
  const std::int32_t* point = nullptr;
};
struct MutableRangeRow {
  float *x = nullptr, *y = nullptr, *z = nullptr, *range = nullptr;
  std::int32_t* point = nullptr;
};
/// The nearest observed one of each four pixels of two rows, `stride` elements apart, into `count`;
/// of equal ones the last of: left, left below, right, right below. 2 · kRangeBlock elements behind
/// the last are read, kRangeBlock written.
void halve_row(const RangeRow& from, std::ptrdiff_t stride, std::ptrdiff_t count,
               const MutableRangeRow& to) noexcept;

}  // namespace grapnel::kernels
