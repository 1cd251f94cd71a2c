#include "pipeline/kernels/block_sums.h"

#include <algorithm>
#include <bit>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pipeline/kernels/block_sums.cpp"
#include "hwy/foreach_target.h"
#include "hwy/highway.h"
#include "pipeline/kernels/block_centres-inl.h"

HWY_BEFORE_NAMESPACE();
namespace grapnel {
namespace kernels {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/// How far stretches of an axis are apart; 0 where they overlap.
HWY_INLINE V Apart(const float* low, const float* high, float box_low, float box_high) {
  const V before = hn::Sub(hn::LoadU(Lanes(), low), Number(box_high));
  const V behind = hn::Sub(Number(box_low), hn::LoadU(Lanes(), high));
  return hn::Max(hn::Max(before, behind), hn::Zero(Lanes()));
}

void NearMembers(const BoxPlanes& boxes, const float* begin, std::span<const PointRange> ranges,
                 const Box& box, float squared_m2, Stretches& members) {
  const Lanes d;
  const auto lanes = static_cast<std::int32_t>(hn::Lanes(d));
  const V limit = Number(squared_m2);
  for (const PointRange& range : ranges) {
    for (std::int32_t i = range.begin; i < range.end; i += lanes) {
      const V x = Apart(boxes.low_x + i, boxes.high_x + i, box.low[0], box.high[0]);
      const V y = Apart(boxes.low_y + i, boxes.high_y + i, box.low[1], box.high[1]);
      const V z = Apart(boxes.low_z + i, boxes.high_z + i, box.low[2], box.high[2]);
      const V squared = hn::Add(hn::Add(hn::Mul(x, x), hn::Mul(y, y)), hn::Mul(z, z));
      std::uint8_t bits[8] = {};
      hn::StoreMaskBits(d, hn::Le(squared, limit), bits);
      const std::uint32_t in_range = (1U << std::min(lanes, range.end - i)) - 1U;
      std::uint32_t rest = bits[0] & in_range;
      while (rest != 0) {
        const int first = std::countr_zero(rest);
        const int behind = first + std::countr_one(rest >> first);
        members.add({static_cast<std::int32_t>(begin[i + first]),
                     static_cast<std::int32_t>(begin[i + behind])});
        rest = rest >> behind << behind;
      }
    }
  }
}

template <bool kFirst>
HWY_INLINE void ScatterLanes(const PointPlanes& points, const BlockOfPoints& block,
                             std::span<const PointRange> ranges, float squared_m2,
                             std::int32_t lane, float (*sums)[kBlock]) {
  const V limit = Number(squared_m2);
  const V one = Number(1.0F);
  const Centres c = CentresOf(points, block, lane);
  Sums s = NoSums();
  // Most points lie in some sphere: to ask costs more than to add zeros.
  for (const PointRange& range : ranges) {
    for (std::int32_t i = range.begin; i < range.end; ++i) {
      const Offsets to = OffsetsOf(points, i, c);
      const auto inside = hn::Le(to.squared, limit);
      const V kx = hn::IfThenElseZero(inside, to.x);
      const V ky = hn::IfThenElseZero(inside, to.y);
      const V kz = hn::IfThenElseZero(inside, to.z);
      s.count = hn::Add(s.count, hn::IfThenElseZero(inside, one));
      if (kFirst) {
        s.x = hn::Add(s.x, kx);
        s.y = hn::Add(s.y, ky);
        s.z = hn::Add(s.z, kz);
      }
      AddProducts(kx, ky, kz, s);
    }
  }
  StoreSums(s, lane, sums);
}

void BlockScatter(const PointPlanes& points, const BlockOfPoints& block,
                  std::span<const PointRange> ranges, float squared_m2, bool first,
                  float (*sums)[kBlock]) {
  const auto lanes = static_cast<std::int32_t>(hn::Lanes(Lanes()));
  for (std::int32_t lane = 0; lane < kBlock; lane += lanes) {
    if (first) {
      ScatterLanes<true>(points, block, ranges, squared_m2, lane, sums);
    } else {
      ScatterLanes<false>(points, block, ranges, squared_m2, lane, sums);
    }
  }
}

template <bool kAbout>
HWY_INLINE void NormalLanes(const PointPlanes& points, const NormalPlanes& normals,
                            const BlockOfPoints& block, std::span<const PointRange> ranges,
                            float squared_m2, std::int32_t lane, float (*sums)[kBlock]) {
  const Lanes d;
  const V limit = Number(squared_m2);
  const Centres c = CentresOf(points, block, lane);
  const std::int32_t at = block.first + lane;
  const V own_x = hn::LoadU(d, normals.x + at);
  const V own_y = hn::LoadU(d, normals.y + at);
  const V own_z = hn::LoadU(d, normals.z + at);
  Sums s = NoSums();
  for (const PointRange& range : ranges) {
    for (std::int32_t i = range.begin; i < range.end; ++i) {
      const auto inside = hn::Le(OffsetsOf(points, i, c).squared, limit);
      const V weight = hn::IfThenElseZero(inside, Number(normals.weight[i]));
      V kx = Number(normals.x[i]);
      V ky = Number(normals.y[i]);
      V kz = Number(normals.z[i]);
      if (kAbout) {
        kx = hn::Mul(weight, hn::Sub(kx, own_x));
        ky = hn::Mul(weight, hn::Sub(ky, own_y));
        kz = hn::Mul(weight, hn::Sub(kz, own_z));
      } else {
        kx = hn::IfThenElseZero(inside, kx);
        ky = hn::IfThenElseZero(inside, ky);
        kz = hn::IfThenElseZero(inside, kz);
      }
      s.count = hn::Add(s.count, weight);
      s.x = hn::Add(s.x, kx);
      s.y = hn::Add(s.y, ky);
      s.z = hn::Add(s.z, kz);
      AddProducts(kx, ky, kz, s);
    }
  }
  StoreSums(s, lane, sums);
}

void BlockNormals(const PointPlanes& points, const NormalPlanes& normals,
                  const BlockOfPoints& block, std::span<const PointRange> ranges, float squared_m2,
                  bool about, float (*sums)[kBlock]) {
  const auto lanes = static_cast<std::int32_t>(hn::Lanes(Lanes()));
  for (std::int32_t lane = 0; lane < kBlock; lane += lanes) {
    if (about) {
      NormalLanes<true>(points, normals, block, ranges, squared_m2, lane, sums);
    } else {
      NormalLanes<false>(points, normals, block, ranges, squared_m2, lane, sums);
    }
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace kernels
}  // namespace grapnel
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace grapnel::kernels {

HWY_EXPORT(NearMembers);
HWY_EXPORT(BlockScatter);
HWY_EXPORT(BlockNormals);

void near_members(const BoxPlanes& boxes, const float* begin, std::span<const PointRange> ranges,
                  const Box& box, float squared_m2, Stretches& members) noexcept {
  HWY_DYNAMIC_DISPATCH(NearMembers)(boxes, begin, ranges, box, squared_m2, members);
}

void block_scatter(const PointPlanes& points, const BlockOfPoints& block,
                   std::span<const PointRange> ranges, float squared_m2, bool first,
                   float (*sums)[kBlock]) noexcept {
  HWY_DYNAMIC_DISPATCH(BlockScatter)(points, block, ranges, squared_m2, first, sums);
}

void block_normals(const PointPlanes& points, const NormalPlanes& normals,
                   const BlockOfPoints& block, std::span<const PointRange> ranges, float squared_m2,
                   bool about, float (*sums)[kBlock]) noexcept {
  HWY_DYNAMIC_DISPATCH(BlockNormals)(points, normals, block, ranges, squared_m2, about, sums);
}

}  // namespace grapnel::kernels
#endif
