#pragma once

#include <array>
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

/// Stretches, ascending. Where there is no room, the last one grows over a gap.
class Stretches {
 public:
  void clear() noexcept { count_ = 0; }
  void add(PointRange range) noexcept {
    if (count_ > 0 && (list_[count_ - 1].end == range.begin || count_ == list_.size())) {
      list_[count_ - 1].end = range.end;
    } else {
      list_[count_++] = range;
    }
  }
  [[nodiscard]] std::span<const PointRange> list() const noexcept {
    return std::span<const PointRange>(list_).first(count_);
  }

 private:
  std::array<PointRange, 128> list_;
  std::size_t count_ = 0;
};

/// Adds what the boxes of the ranges (not empty, ascending) hold that are at most the root of
/// `squared_m2` away from a box. Box i holds begin[i]…begin[i + 1] - 1.
void near_members(const BoxPlanes& boxes, const float* begin, std::span<const PointRange> ranges,
                  const Box& box, float squared_m2, Stretches& members) noexcept;

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
