#include "pipeline/kernels/gaussian_sums.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pipeline/kernels/gaussian_sums.cpp"
#include "hwy/foreach_target.h"
#include "hwy/highway.h"

HWY_BEFORE_NAMESPACE();
namespace grapnel {
namespace kernels {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

constexpr std::size_t kEight = 8;
using Lanes = hn::CappedTag<float, kEight>;
using V = hn::Vec<Lanes>;

/// exp(-x) for x in 0…4.5: powers of two times Taylor's series on ±ln(2)/2.
HWY_INLINE V ExpMinus(V x) {
  const Lanes d;
  const hn::RebindToSigned<Lanes> di;
  const V steps = hn::Round(hn::Mul(x, hn::Set(d, -1.44269504F)));
  const V rest = hn::Sub(hn::Sub(hn::Zero(d), x), hn::Mul(steps, hn::Set(d, 0.693147181F)));
  V sum = hn::Set(d, 1.0F / 720.0F);
  for (const float c : {1.0F / 120.0F, 1.0F / 24.0F, 1.0F / 6.0F, 0.5F, 1.0F, 1.0F}) {
    sum = hn::Add(hn::Mul(sum, rest), hn::Set(d, c));
  }
  const auto exponent = hn::Add(hn::ConvertTo(di, steps), hn::Set(di, 127));
  return hn::Mul(sum, hn::BitCast(d, hn::ShiftLeft<23>(exponent)));
}

GaussianSums Sums(std::span<const std::int32_t> index, const float* squared_m2, const float* values,
                  const GaussianScales& scales) {
  const Lanes d;
  const hn::RebindToSigned<Lanes> di;
  HWY_ALIGN float weighted[kMaxScales][kEight];
  HWY_ALIGN float weight[kMaxScales][kEight];
  for (std::size_t lane = 0; lane < kEight; lane += hn::Lanes(d)) {
    V value_sum[kMaxScales];
    V weight_sum[kMaxScales];
    for (std::size_t k = 0; k < scales.count; ++k) value_sum[k] = weight_sum[k] = hn::Zero(d);
    for (std::size_t i = lane; i < index.size(); i += kEight) {
      const auto behind = static_cast<std::int32_t>(index.size() - i);
      const auto valid = hn::Lt(hn::Iota(di, 0), hn::Set(di, behind));
      const auto at = hn::IfThenElseZero(valid, hn::LoadU(di, index.data() + i));
      const V squared = hn::LoadU(d, squared_m2 + i);
      const V value = hn::GatherIndex(d, values, at);
      V w[kMaxScales];
      for (std::size_t k = scales.count; k-- > 0;) {
        const auto near =
            hn::And(hn::RebindMask(d, valid), hn::Le(squared, hn::Set(d, scales.reach_m2[k])));
        if (k + scales.per_octave < scales.count) {
          const V wide = w[k + scales.per_octave];
          const V two = hn::Mul(wide, wide);
          w[k] = hn::IfThenElseZero(near, hn::Mul(two, two));
        } else {
          w[k] = hn::IfThenElseZero(near,
                                    ExpMinus(hn::Mul(squared, hn::Set(d, scales.inverse_m2[k]))));
        }
        weight_sum[k] = hn::Add(weight_sum[k], w[k]);
        value_sum[k] = hn::Add(value_sum[k], hn::Mul(w[k], value));
      }
    }
    for (std::size_t k = 0; k < scales.count; ++k) {
      hn::Store(value_sum[k], d, weighted[k] + lane);
      hn::Store(weight_sum[k], d, weight[k] + lane);
    }
  }
  const auto fold = [](const float* s) {
    return ((s[0] + s[4]) + (s[2] + s[6])) + ((s[1] + s[5]) + (s[3] + s[7]));
  };
  GaussianSums sums;
  for (std::size_t k = 0; k < scales.count; ++k) {
    sums.weighted[k] = fold(weighted[k]);
    sums.weight[k] = fold(weight[k]);
  }
  return sums;
}

}  // namespace HWY_NAMESPACE
}  // namespace kernels
}  // namespace grapnel
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace grapnel::kernels {

HWY_EXPORT(Sums);

GaussianSums gaussian_sums(std::span<const std::int32_t> index, const float* squared_m2,
                           const float* values, const GaussianScales& scales) noexcept {
  return HWY_DYNAMIC_DISPATCH(Sums)(index, squared_m2, values, scales);
}

}  // namespace grapnel::kernels
#endif
