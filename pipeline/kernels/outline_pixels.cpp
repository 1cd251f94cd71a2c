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

}  // namespace HWY_NAMESPACE
}  // namespace kernels
}  // namespace grapnel
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace grapnel::kernels {

HWY_EXPORT(OutlinePixels);

std::size_t outline_pixels(const float* row, std::ptrdiff_t width, std::size_t count,
                           const OutlineLaw& law, std::int32_t* found) noexcept {
  return HWY_DYNAMIC_DISPATCH(OutlinePixels)(row, width, count, law, found);
}

namespace reference {

std::size_t outline_pixels(const float* row, std::ptrdiff_t width, std::size_t count,
                           const OutlineLaw& law, std::int32_t* found) noexcept {
  std::size_t made = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const float* at = row + i;
    const float z = *at;
    if (!(z > 0.0F)) continue;
    const float sigma_m = std::max(law.sigma_per_m2 * z * z, law.sigma_floor_m);
    const float behind = z + law.slack_m + 8.0F * sigma_m;
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
