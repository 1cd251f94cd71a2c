#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "pipeline/kernels/window_sums.h"

namespace grapnel::kernels {

/// Boxes along the axes, one array a side, with kSlack elements behind the last.
struct BoxPlanes {
  const float *low_x = nullptr, *low_y = nullptr, *low_z = nullptr;
  const float *high_x = nullptr, *high_y = nullptr, *high_z = nullptr;
};
struct Box {
  float low[3] = {};
  float high[3] = {};
};

/// Those of the boxes begin…end that are at most the root of `squared_m2` away from a box,
/// ascending in `found`, which holds all of them plus kSlack. Returns their number.
std::size_t near_boxes(const BoxPlanes& boxes, PointRange range, const Box& box, float squared_m2,
                       std::int32_t* found) noexcept;

/// Consecutive points, at most kBlock of them, whose spheres are summed together.
struct BlockOfPoints {
  std::int32_t first = 0;
  std::int32_t count = 0;
};

/// Sums as window_scatter's of the ranges' points in each of the block's spheres. They run through
/// the ranges in order: the same bits for every width of vector, and whatever else is in the block.
void block_scatter(const PointPlanes& points, const BlockOfPoints& block,
                   std::span<const PointRange> ranges, float squared_m2, bool first,
                   float (*sums)[kBlock]) noexcept;

/// The same as window_normals'.
void block_normals(const PointPlanes& points, const NormalPlanes& normals,
                   const BlockOfPoints& block, std::span<const PointRange> ranges, float squared_m2,
                   bool about, float (*sums)[kBlock]) noexcept;

}  // namespace grapnel::kernels
