#include "pipeline/kernels/gaussian_sums.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pipeline/kernels/gaussian_sums.cpp"
#include "hwy/foreach_target.h"
#include "hwy/highway.h"
#include "pipeline/kernels/block_centres-inl.h"

HWY_BEFORE_NAMESPACE();
namespace grapnel {
namespace kernels {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

HWY_INLINE V FourthPower(V x) {
  const V two = hn::Mul(x, x);
  return hn::Mul(two, two);
}

/// exp(-8 y) for y in 0…0.5625: a polynomial that is exp(-y) to 2.4e-8 (least largest error), and
/// its eighth power.
HWY_INLINE V ExpMinusEight(V y) {
  V sum = Number(-0.00630488293F);
  for (const float c : {0.0404472575F, -0.166323021F, 0.499956877F, -0.999998212F, 1.0F}) {
    sum = hn::Add(hn::Mul(sum, y), Number(c));
  }
  return FourthPower(hn::Mul(sum, sum));
}

/// How many scales there are is known to the compiler: no loop is left inside.
template <std::size_t kPerOctave>
void MeanLanes(const PointPlanes& points, const float* values, const BlockOfPoints& block,
               std::span<const PointRange> ranges, const GaussianScales& scales, std::int32_t lane,
               float (*means)[kBlock]) {
  constexpr std::size_t kNarrow = 3;
  constexpr std::size_t kCount = kPerOctave + kNarrow;
  const Lanes d;
  const Centres c = CentresOf(points, block, lane);
  V value_sum[kCount];
  V weight_sum[kCount];
  for (std::size_t k = 0; k < kCount; ++k) value_sum[k] = weight_sum[k] = hn::Zero(d);
  for (const PointRange& range : ranges) {
    for (std::int32_t i = range.begin; i < range.end; ++i) {
      const V squared = OffsetsOf(points, i, c).squared;
      const auto within = [&](std::size_t k) {
        return hn::Le(squared, Number(scales.reach_m2[k]));
      };
      if (hn::AllFalse(d, within(kCount - 1))) continue;
      const V value = Number(values[i]);
      V weight[kCount];
      const auto add = [&](std::size_t k) {
        const V w = hn::IfThenElseZero(within(k), weight[k]);
        weight_sum[k] = hn::Add(weight_sum[k], w);
        value_sum[k] = hn::Add(value_sum[k], hn::Mul(w, value));
      };
      for (std::size_t k = kCount; k-- > kNarrow;) {
        weight[k] = ExpMinusEight(hn::Mul(squared, Number(scales.eighth_m2[k])));
        add(k);
      }
      if (hn::AllFalse(d, within(kNarrow - 1))) continue;
      for (std::size_t k = kNarrow; k-- > 0;) {
        weight[k] = FourthPower(weight[k + kPerOctave]);
        add(k);
      }
    }
  }
  for (std::size_t k = 0; k < kCount; ++k) {
    // A point's own weight is 1; lanes behind the block's last point have none.
    const V mean = hn::Div(value_sum[k], hn::Max(weight_sum[k], Number(1.0F)));
    hn::StoreU(mean, d, means[k] + lane);
  }
}

template <std::size_t kPerOctave>
void Means(const PointPlanes& points, const float* values, const BlockOfPoints& block,
           std::span<const PointRange> ranges, const GaussianScales& scales,
           float (*means)[kBlock]) {
  const auto lanes = static_cast<std::int32_t>(hn::Lanes(Lanes()));
  for (std::int32_t lane = 0; lane < kBlock; lane += lanes) {
    MeanLanes<kPerOctave>(points, values, block, ranges, scales, lane, means);
  }
}

void GaussianMeans(const PointPlanes& points, const float* values, const BlockOfPoints& block,
                   std::span<const PointRange> ranges, const GaussianScales& scales,
                   float (*means)[kBlock]) {
  constexpr decltype(&Means<1>) kMeans[kMaxPerOctave] = {Means<1>, Means<2>, Means<3>, Means<4>,
                                                         Means<5>};
  kMeans[scales.per_octave - 1](points, values, block, ranges, scales, means);
}

}  // namespace HWY_NAMESPACE
}  // namespace kernels
}  // namespace grapnel
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace grapnel::kernels {

HWY_EXPORT(GaussianMeans);

void gaussian_means(const PointPlanes& points, const float* values, const BlockOfPoints& block,
                    std::span<const PointRange> ranges, const GaussianScales& scales,
                    float (*means)[kBlock]) noexcept {
  HWY_DYNAMIC_DISPATCH(GaussianMeans)(points, values, block, ranges, scales, means);
}

}  // namespace grapnel::kernels
#endif
