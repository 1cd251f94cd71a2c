#include "pipeline/kernels/range_levels.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pipeline/kernels/range_levels.cpp"
#include "hwy/foreach_target.h"
#include "hwy/highway.h"

HWY_BEFORE_NAMESPACE();
namespace grapnel {
namespace kernels {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Lanes = hn::CappedTag<float, 8>;
using V = hn::Vec<Lanes>;

void Ranges(const RangePlanes& row, std::ptrdiff_t count, float* range, float* nearest,
            float* farthest) {
  const Lanes d;
  const V zero = hn::Zero(d);
  const V far = hn::Set(d, 1e14F);
  V low = hn::Set(d, *nearest);
  V high = hn::Set(d, *farthest);
  const hn::RebindToSigned<Lanes> di;
  for (std::ptrdiff_t i = 0; i < count; i += static_cast<std::ptrdiff_t>(hn::Lanes(d))) {
    const V x = hn::LoadU(d, row.x + i);
    const V y = hn::LoadU(d, row.y + i);
    const V z = hn::LoadU(d, row.z + i);
    const V squared = hn::Add(hn::Add(hn::Mul(x, x), hn::Mul(y, y)), hn::Mul(z, z));
    const auto rest = hn::Set(di, static_cast<std::int32_t>(count - i));
    const auto valid = hn::And(hn::Lt(x, far), hn::RebindMask(d, hn::Lt(hn::Iota(di, 0), rest)));
    const V length = hn::IfThenElseZero(valid, hn::Sqrt(squared));
    hn::StoreU(length, d, range + i);
    low = hn::Min(low, hn::IfThenElse(valid, length, far));
    high = hn::Max(high, hn::Max(length, zero));
  }
  *nearest = hn::GetLane(hn::MinOfLanes(d, low));
  *farthest = hn::GetLane(hn::MaxOfLanes(d, high));
}

void HalveRow(const RangeRow& from, std::ptrdiff_t stride, std::ptrdiff_t count,
              const MutableRangeRow& to) {
  const Lanes d;
  const hn::RebindToSigned<Lanes> di;
  const float* const in[4] = {from.x, from.y, from.z, from.range};
  float* const out[4] = {to.x, to.y, to.z, to.range};
  for (std::ptrdiff_t i = 0; i < count; i += static_cast<std::ptrdiff_t>(hn::Lanes(d))) {
    V value[4][4];
    hn::Vec<decltype(di)> point[4];
    // Left above, left below, right above, right below.
    for (int plane = 0; plane < 4; ++plane) {
      hn::LoadInterleaved2(d, in[plane] + 2 * i, value[0][plane], value[2][plane]);
      hn::LoadInterleaved2(d, in[plane] + stride + 2 * i, value[1][plane], value[3][plane]);
    }
    hn::LoadInterleaved2(di, from.point + 2 * i, point[0], point[2]);
    hn::LoadInterleaved2(di, from.point + stride + 2 * i, point[1], point[3]);
    const auto key = [&](int k) {
      // What is not observed comes last, behind what is far.
      const auto valid = hn::Lt(value[k][0], hn::Set(d, 1e14F));
      return hn::IfThenElse(valid, value[k][3], hn::Sub(hn::Set(d, 3e15F), value[k][0]));
    };
    V least = key(0);
    for (int k = 1; k < 4; ++k) {
      const V own = key(k);
      const auto nearer = hn::Le(own, least);
      least = hn::Min(own, least);
      for (int plane = 0; plane < 4; ++plane) {
        value[0][plane] = hn::IfThenElse(nearer, value[k][plane], value[0][plane]);
      }
      point[0] = hn::IfThenElse(hn::RebindMask(di, nearer), point[k], point[0]);
    }
    for (int plane = 0; plane < 4; ++plane) hn::StoreU(value[0][plane], d, out[plane] + i);
    hn::StoreU(point[0], di, to.point + i);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace kernels
}  // namespace grapnel
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace grapnel::kernels {

HWY_EXPORT(Ranges);
HWY_EXPORT(HalveRow);

void ranges(const RangePlanes& row, std::ptrdiff_t count, float* range, float* nearest,
            float* farthest) noexcept {
  HWY_DYNAMIC_DISPATCH(Ranges)(row, count, range, nearest, farthest);
}
void halve_row(const RangeRow& from, std::ptrdiff_t stride, std::ptrdiff_t count,
               const MutableRangeRow& to) noexcept {
  HWY_DYNAMIC_DISPATCH(HalveRow)(from, stride, count, to);
}

}  // namespace grapnel::kernels
#endif
