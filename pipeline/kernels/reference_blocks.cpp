#include <algorithm>
#include <array>

#include "pipeline/kernels/reference.h"

namespace grapnel::kernels::reference {
namespace {

using Offset = std::array<float, 3>;

Offset at(const float* x, const float* y, const float* z, std::int32_t i) {
  return {x[i], y[i], z[i]};
}
Offset less(const Offset& a, const Offset& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
float squared(const Offset& p) { return (p[0] * p[0] + p[1] * p[1]) + p[2] * p[2]; }

/// Adds a point with its weight to a lane's sums.
void add(const Offset& p, float weight, bool first, int lane, float (*sums)[kBlock]) {
  sums[0][lane] += weight;
  int product = 4;
  for (int a = 0; a < 3; ++a) {
    if (first) sums[a + 1][lane] += p[static_cast<std::size_t>(a)];
    for (int b = a; b < 3; ++b) {
      sums[product++][lane] += p[static_cast<std::size_t>(a)] * p[static_cast<std::size_t>(b)];
    }
  }
}

/// Calls use(lane, point, offset) for the points of the ranges in each of a block's spheres.
template <class Use>
void each_inside(const PointPlanes& points, const BlockOfPoints& block,
                 std::span<const PointRange> ranges, float squared_m2, const Use& use) {
  for (int lane = 0; lane < block.count; ++lane) {
    const Offset centre = at(points.x, points.y, points.z, block.first + lane);
    for (const PointRange& range : ranges) {
      for (std::int32_t i = range.begin; i < range.end; ++i) {
        const Offset offset = less(at(points.x, points.y, points.z, i), centre);
        if (squared(offset) <= squared_m2) use(lane, i, offset);
      }
    }
  }
}

void clear(float (*sums)[kBlock]) {
  for (int k = 0; k < kWindowSums; ++k) std::fill_n(sums[k], kBlock, 0.0F);
}

}  // namespace

void near_members(const BoxPlanes& boxes, const float* begin, std::span<const PointRange> ranges,
                  const Box& box, float squared_m2, Stretches& members) noexcept {
  for (const PointRange& range : ranges) {
    for (std::int32_t i = range.begin; i < range.end; ++i) {
      const Offset low = at(boxes.low_x, boxes.low_y, boxes.low_z, i);
      const Offset high = at(boxes.high_x, boxes.high_y, boxes.high_z, i);
      Offset apart{};
      for (std::size_t k = 0; k < 3; ++k) {
        apart[k] = std::max({low[k] - box.high[k], box.low[k] - high[k], 0.0F});
      }
      if (squared(apart) > squared_m2) continue;
      members.add({static_cast<std::int32_t>(begin[i]), static_cast<std::int32_t>(begin[i + 1])});
    }
  }
}

void block_scatter(const PointPlanes& points, const BlockOfPoints& block,
                   std::span<const PointRange> ranges, float squared_m2, bool first,
                   float (*sums)[kBlock]) noexcept {
  clear(sums);
  each_inside(points, block, ranges, squared_m2,
              [&](int lane, std::int32_t, const Offset& p) { add(p, 1.0F, first, lane, sums); });
}

void block_normals(const PointPlanes& points, const NormalPlanes& normals,
                   const BlockOfPoints& block, std::span<const PointRange> ranges, float squared_m2,
                   bool about, float (*sums)[kBlock]) noexcept {
  clear(sums);
  each_inside(points, block, ranges, squared_m2, [&](int lane, std::int32_t i, const Offset&) {
    const float weight = normals.weight[i];
    Offset normal = at(normals.x, normals.y, normals.z, i);
    if (about) {
      normal = less(normal, at(normals.x, normals.y, normals.z, block.first + lane));
      for (float& value : normal) value *= weight;
    }
    add(normal, weight, true, lane, sums);
  });
}

}  // namespace grapnel::kernels::reference
