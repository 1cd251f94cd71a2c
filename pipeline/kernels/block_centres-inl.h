// Included once per SIMD target.
#if defined(GRAPNEL_KERNELS_BLOCK_CENTRES_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef GRAPNEL_KERNELS_BLOCK_CENTRES_INL_H_
#undef GRAPNEL_KERNELS_BLOCK_CENTRES_INL_H_
#else
#define GRAPNEL_KERNELS_BLOCK_CENTRES_INL_H_
#endif

#include <cstdint>

#include "hwy/highway.h"
#include "pipeline/kernels/block_sums.h"
#include "pipeline/kernels/moment_sums-inl.h"

HWY_BEFORE_NAMESPACE();
namespace grapnel {
namespace kernels {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

HWY_INLINE V Number(float value) { return hn::Set(Lanes(), value); }

struct Centres {
  V x, y, z;
};
/// Of a block's lanes; what is none of it lies far from everything.
HWY_INLINE Centres CentresOf(const PointPlanes& points, const BlockOfPoints& block,
                             std::int32_t lane) {
  const Lanes d;
  const hn::RebindToSigned<Lanes> di;
  const auto own = hn::RebindMask(d, hn::Lt(hn::Iota(di, lane), hn::Set(di, block.count)));
  const std::int32_t at = block.first + lane;
  return {hn::IfThenElse(own, hn::LoadU(d, points.x + at), Number(kNowhere)),
          hn::LoadU(d, points.y + at), hn::LoadU(d, points.z + at)};
}

/// A point seen from the centres.
struct Offsets {
  V x, y, z, squared;
};
HWY_INLINE Offsets OffsetsOf(const PointPlanes& points, std::int32_t i, const Centres& c) {
  const V x = hn::Sub(Number(points.x[i]), c.x);
  const V y = hn::Sub(Number(points.y[i]), c.y);
  const V z = hn::Sub(Number(points.z[i]), c.z);
  return {x, y, z, hn::Add(hn::Add(hn::Mul(x, x), hn::Mul(y, y)), hn::Mul(z, z))};
}

}  // namespace HWY_NAMESPACE
}  // namespace kernels
}  // namespace grapnel
HWY_AFTER_NAMESPACE();

#endif  // GRAPNEL_KERNELS_BLOCK_CENTRES_INL_H_
