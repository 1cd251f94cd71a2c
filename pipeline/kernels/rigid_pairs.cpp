#include "pipeline/kernels/rigid_pairs.h"

#include <algorithm>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pipeline/kernels/rigid_pairs.cpp"
#include "hwy/foreach_target.h"
#include "hwy/highway.h"

HWY_BEFORE_NAMESPACE();
namespace grapnel {
namespace kernels {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

constexpr std::size_t kCheckEvery = 128;  ///< pairs between two looks at what can still be reached

std::size_t CountInliers(const PairPlanes& pairs, std::size_t count, const RigidMotion& motion,
                         float squared_m2, std::size_t to_beat) {
  const hn::CappedTag<float, 8> d;
  using V = hn::Vec<decltype(d)>;
  const hn::RebindToSigned<decltype(d)> di;
  const std::size_t lanes = hn::Lanes(d);
  const auto row = [&](int i, V x, V y, V z) {
    const auto r = [&](int k) { return hn::Set(d, motion.r[3 * i + k]); };
    return hn::Add(hn::Add(hn::Mul(r(0), x), hn::Mul(r(1), y)),
                   hn::Add(hn::Mul(r(2), z), hn::Set(d, motion.t[i])));
  };
  const V limit = hn::Set(d, squared_m2);
  const auto end = hn::Set(di, static_cast<std::int32_t>(count));
  std::size_t inliers = 0;
  for (std::size_t start = 0; start < count; start += kCheckEvery) {
    if (inliers + (count - start) <= to_beat) return inliers;
    const std::size_t stop = std::min(count, start + kCheckEvery);
    for (std::size_t i = start; i < stop; i += lanes) {
      const V x = hn::LoadU(d, pairs.sx + i);
      const V y = hn::LoadU(d, pairs.sy + i);
      const V z = hn::LoadU(d, pairs.sz + i);
      const V dx = hn::Sub(row(0, x, y, z), hn::LoadU(d, pairs.tx + i));
      const V dy = hn::Sub(row(1, x, y, z), hn::LoadU(d, pairs.ty + i));
      const V dz = hn::Sub(row(2, x, y, z), hn::LoadU(d, pairs.tz + i));
      const V squared = hn::Add(hn::Add(hn::Mul(dx, dx), hn::Mul(dy, dy)), hn::Mul(dz, dz));
      const auto real = hn::RebindMask(d, hn::Lt(hn::Iota(di, static_cast<std::int32_t>(i)), end));
      inliers += hn::CountTrue(d, hn::And(real, hn::Le(squared, limit)));
    }
  }
  return inliers;
}

void AgreeingPairs(const PairPlanes& pairs, std::size_t count, std::size_t pair_i,
                   const PairAgreement& agreement, std::uint64_t* bits) {
  const hn::CappedTag<float, 8> d;
  using V = hn::Vec<decltype(d)>;
  const hn::RebindToSigned<decltype(d)> di;
  const std::size_t lanes = hn::Lanes(d);
  const auto length_from = [&](const float* x, const float* y, const float* z, std::size_t i) {
    const V dx = hn::Sub(hn::LoadU(d, x + i), hn::Set(d, x[pair_i]));
    const V dy = hn::Sub(hn::LoadU(d, y + i), hn::Set(d, y[pair_i]));
    const V dz = hn::Sub(hn::LoadU(d, z + i), hn::Set(d, z[pair_i]));
    return hn::Sqrt(hn::Add(hn::Add(hn::Mul(dx, dx), hn::Mul(dy, dy)), hn::Mul(dz, dz)));
  };
  const V tolerance = hn::Set(d, agreement.tolerance_m);
  const V shortest = hn::Set(d, agreement.min_length_m);
  const auto end = hn::Set(di, static_cast<std::int32_t>(count));
  const auto lane_bits = static_cast<std::uint64_t>((1U << lanes) - 1U);
  std::fill_n(bits, (count + 63) / 64, std::uint64_t{0});
  for (std::size_t i = 0; i < count; i += lanes) {
    const V source = length_from(pairs.sx, pairs.sy, pairs.sz, i);
    const V target = length_from(pairs.tx, pairs.ty, pairs.tz, i);
    const auto real = hn::RebindMask(d, hn::Lt(hn::Iota(di, static_cast<std::int32_t>(i)), end));
    const auto agrees = hn::And(hn::And(real, hn::Le(hn::Abs(hn::Sub(source, target)), tolerance)),
                                hn::Ge(hn::Min(source, target), shortest));
    std::uint8_t mask[8] = {};
    hn::StoreMaskBits(d, agrees, mask);
    bits[i / 64] |= (mask[0] & lane_bits) << (i % 64);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace kernels
}  // namespace grapnel
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace grapnel::kernels {

HWY_EXPORT(CountInliers);
HWY_EXPORT(AgreeingPairs);

std::size_t count_inliers(const PairPlanes& pairs, std::size_t count, const RigidMotion& motion,
                          float squared_m2, std::size_t to_beat) noexcept {
  return HWY_DYNAMIC_DISPATCH(CountInliers)(pairs, count, motion, squared_m2, to_beat);
}

void agreeing_pairs(const PairPlanes& pairs, std::size_t count, std::size_t pair_i,
                    const PairAgreement& agreement, std::uint64_t* bits) noexcept {
  HWY_DYNAMIC_DISPATCH(AgreeingPairs)(pairs, count, pair_i, agreement, bits);
}

}  // namespace grapnel::kernels
#endif
