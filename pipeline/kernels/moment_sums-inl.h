// Included once per SIMD target.
#if defined(GRAPNEL_KERNELS_MOMENT_SUMS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef GRAPNEL_KERNELS_MOMENT_SUMS_INL_H_
#undef GRAPNEL_KERNELS_MOMENT_SUMS_INL_H_
#else
#define GRAPNEL_KERNELS_MOMENT_SUMS_INL_H_
#endif

#include <cstddef>

#include "hwy/highway.h"
#include "pipeline/kernels/window_sums.h"

HWY_BEFORE_NAMESPACE();
namespace grapnel {
namespace kernels {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Lanes = hn::CappedTag<float, kBlock>;
using V = hn::Vec<Lanes>;

/// Number, first moments and products, as they add up over a neighbourhood.
struct Sums {
  V count, x, y, z, xx, xy, xz, yy, yz, zz;
};

HWY_INLINE Sums NoSums() {
  const V zero = hn::Zero(Lanes());
  return {zero, zero, zero, zero, zero, zero, zero, zero, zero, zero};
}

/// Adds (kx, ky, kz), already zero where masked out.
HWY_INLINE void AddProducts(V kx, V ky, V kz, Sums& s) {
  s.xx = hn::Add(s.xx, hn::Mul(kx, kx));
  s.xy = hn::Add(s.xy, hn::Mul(kx, ky));
  s.xz = hn::Add(s.xz, hn::Mul(kx, kz));
  s.yy = hn::Add(s.yy, hn::Mul(ky, ky));
  s.yz = hn::Add(s.yz, hn::Mul(ky, kz));
  s.zz = hn::Add(s.zz, hn::Mul(kz, kz));
}

HWY_INLINE void StoreSums(const Sums& s, std::ptrdiff_t lane, float (*sums)[kBlock]) {
  const V all[kWindowSums] = {s.count, s.x, s.y, s.z, s.xx, s.xy, s.xz, s.yy, s.yz, s.zz};
  for (int k = 0; k < kWindowSums; ++k) hn::StoreU(all[k], Lanes(), sums[k] + lane);
}

}  // namespace HWY_NAMESPACE
}  // namespace kernels
}  // namespace grapnel
HWY_AFTER_NAMESPACE();

#endif  // GRAPNEL_KERNELS_MOMENT_SUMS_INL_H_
