#include "pipeline/kernels/outline_pixels.h"

#include <algorithm>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pipeline/kernels/outline_pixels.cpp"
#include "hwy/foreach_target.h"
#include "hwy/highway.h"

HWY_BEFORE_NAMESPACE();
namespace grapnel {
namespace kernels {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

std::size_t OutlinePixels(const float* row, std::ptrdiff_t width, std::size_t count,
                          const OutlineLaw& law, std::int32_t* found) {
  const hn::CappedTag<float, kOutlinePad> d;
  const hn::RebindToSigned<decltype(d)> di;
  const auto zero = hn::Zero(d);
  const auto slack = hn::Set(d, law.slack_m);
  const auto per_m2 = hn::Set(d, law.sigma_per_m2);
  const auto floor = hn::Set(d, law.sigma_floor_m);
  const auto eight = hn::Set(d, 8.0F);
  std::size_t made = 0;
  for (std::size_t i = 0; i < count; i += hn::Lanes(d)) {
    const float* at = row + i;
    const auto z = hn::LoadU(d, at);
    const auto before = hn::LoadU(d, at - 1);
    const auto after = hn::LoadU(d, at + 1);
    const auto above = hn::LoadU(d, at - width);
    const auto below = hn::LoadU(d, at + width);
    const auto nearest = hn::Min(hn::Min(before, after), hn::Min(above, below));
    const auto farthest = hn::Max(hn::Max(before, after), hn::Max(above, below));
    const auto sigma = hn::Max(hn::Mul(hn::Mul(per_m2, z), z), floor);
    const auto behind = hn::Add(hn::Add(z, slack), hn::Mul(eight, sigma));
    const auto goes_on = hn::And(hn::Gt(nearest, zero), hn::Lt(farthest, behind));
    const auto there = hn::And(hn::Gt(z, zero), hn::FirstN(d, count - i));
    const auto outline = hn::AndNot(goes_on, there);
    if (hn::AllFalse(d, outline)) continue;
    made += hn::CompressStore(hn::Iota(di, static_cast<std::int32_t>(i)),
                              hn::RebindMask(di, outline), di, found + made);
  }
  return made;
}

void OutwardOf(const float* row, std::ptrdiff_t width, const std::int32_t* found, std::size_t count,
               const OutlineLaw& law, float* out_u, float* out_v) {
  const hn::CappedTag<float, kOutlinePad> d;
  constexpr std::size_t kAcross = 2 * kOutwardReach + 1;
  const auto zero = hn::Zero(d);
  for (std::size_t k = 0; k < count; ++k) {
    const float* const at = row + found[k];
    const auto behind = hn::Set(d, behind_m(law, *at));
    // Of every lane, added up over the rows: small whole numbers, so their order is of no account.
    alignas(64) float open_u[kOutlinePad] = {};
    float sum_v = 0.0F;
    for (std::size_t lane = 0; lane < kAcross; lane += hn::Lanes(d)) {
      const auto wanted = hn::FirstN(d, kAcross - lane);
      const auto one = hn::IfThenElseZero(wanted, hn::Set(d, 1.0F));
      auto open = zero;
      auto open_v = zero;
      for (int dv = -kOutwardReach; dv <= kOutwardReach; ++dv) {
        const auto z = hn::LoadU(d, at + dv * width - kOutwardReach + lane);
        const auto goes_on = hn::And(hn::Gt(z, zero), hn::Lt(z, behind));
        const auto here = hn::IfThenZeroElse(goes_on, one);
        open = hn::Add(open, here);
        open_v = hn::Add(open_v, hn::Mul(here, hn::Set(d, static_cast<float>(dv))));
      }
      const auto du = hn::Iota(d, static_cast<float>(lane) - static_cast<float>(kOutwardReach));
      hn::Store(hn::Mul(open, du), d, open_u + lane);
      sum_v += hn::GetLane(hn::SumOfLanes(d, open_v));
    }
    float sum_u = 0.0F;
    for (const float each : open_u) sum_u += each;
    out_u[k] = sum_u;
    out_v[k] = sum_v;
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace kernels
}  // namespace grapnel
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace grapnel::kernels {

HWY_EXPORT(OutlinePixels);
HWY_EXPORT(OutwardOf);

std::size_t outline_pixels(const float* row, std::ptrdiff_t width, std::size_t count,
                           const OutlineLaw& law, std::int32_t* found) noexcept {
  return HWY_DYNAMIC_DISPATCH(OutlinePixels)(row, width, count, law, found);
}

void outward_of(const float* row, std::ptrdiff_t width, const std::int32_t* found,
                std::size_t count, const OutlineLaw& law, float* out_u, float* out_v) noexcept {
  HWY_DYNAMIC_DISPATCH(OutwardOf)(row, width, found, count, law, out_u, out_v);
}

namespace reference {

void outward_of(const float* row, std::ptrdiff_t width, const std::int32_t* found,
                std::size_t count, const OutlineLaw& law, float* out_u, float* out_v) noexcept {
  for (std::size_t k = 0; k < count; ++k) {
    const float* const at = row + found[k];
    const float behind = behind_m(law, *at);
    out_u[k] = 0.0F;
    out_v[k] = 0.0F;
    for (int dv = -kOutwardReach; dv <= kOutwardReach; ++dv) {
      for (int du = -kOutwardReach; du <= kOutwardReach; ++du) {
        const float z = at[dv * width + du];
        if (z > 0.0F && z < behind) continue;
        out_u[k] += static_cast<float>(du);
        out_v[k] += static_cast<float>(dv);
      }
    }
  }
}

std::size_t outline_pixels(const float* row, std::ptrdiff_t width, std::size_t count,
                           const OutlineLaw& law, std::int32_t* found) noexcept {
  std::size_t made = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const float* at = row + i;
    const float z = *at;
    if (!(z > 0.0F)) continue;
    const float behind = behind_m(law, z);
    bool goes_on = true;
    for (const float beside : {at[-1], at[1], at[-width], at[width]}) {
      goes_on = goes_on && beside > 0.0F && beside < behind;
    }
    if (!goes_on) found[made++] = static_cast<std::int32_t>(i);
  }
  return made;
}

}  // namespace reference
}  // namespace grapnel::kernels
#endif
