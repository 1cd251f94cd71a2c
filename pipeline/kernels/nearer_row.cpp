#include "pipeline/kernels/nearer_row.h"

#include <algorithm>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pipeline/kernels/nearer_row.cpp"
#include "hwy/foreach_target.h"
#include "hwy/highway.h"

HWY_BEFORE_NAMESPACE();
namespace grapnel {
namespace kernels {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

void NearerRow(const float* first, const float* second, std::size_t count, const NearerLaw& law,
               std::int8_t* side) {
  const hn::CappedTag<float, kNearerPad> d;
  const hn::RebindToSigned<decltype(d)> di;
  const hn::Rebind<std::int8_t, decltype(d)> d8;
  const auto zero = hn::Zero(d);
  const auto least_sigmas = hn::Set(d, law.least_sigmas);
  const auto per_m2 = hn::Set(d, law.sigma_per_m2);
  const auto floor = hn::Set(d, law.sigma_floor_m);
  const auto one = hn::Set(di, 1);
  for (std::size_t i = 0; i < count; i += hn::Lanes(d)) {
    const auto a = hn::LoadU(d, first + i);
    const auto b = hn::LoadU(d, second + i);
    const auto has_a = hn::Gt(a, zero);
    const auto has_b = hn::Gt(b, zero);
    const auto z = hn::Min(a, b);
    const auto least = hn::Mul(least_sigmas, hn::Max(hn::Mul(hn::Mul(per_m2, z), z), floor));
    const auto a_first = hn::And(has_a, hn::Or(hn::Not(has_b), hn::Lt(a, hn::Sub(b, least))));
    const auto b_first = hn::And(has_b, hn::Or(hn::Not(has_a), hn::Lt(b, hn::Sub(a, least))));
    const auto sign = hn::Sub(hn::IfThenElseZero(hn::RebindMask(di, a_first), one),
                              hn::IfThenElseZero(hn::RebindMask(di, b_first), one));
    hn::StoreU(hn::DemoteTo(d8, sign), d8, side + i);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace kernels
}  // namespace grapnel
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace grapnel::kernels {

HWY_EXPORT(NearerRow);

void nearer_row(const float* first, const float* second, std::size_t count, const NearerLaw& law,
                std::int8_t* side) noexcept {
  HWY_DYNAMIC_DISPATCH(NearerRow)(first, second, count, law, side);
}

namespace reference {

void nearer_row(const float* first, const float* second, std::size_t count, const NearerLaw& law,
                std::int8_t* side) noexcept {
  for (std::size_t i = 0; i < count; ++i) {
    const float a = first[i];
    const float b = second[i];
    side[i] = 0;
    if (!(a > 0.0F) || !(b > 0.0F)) {
      if (a > 0.0F) side[i] = 1;
      if (b > 0.0F) side[i] = -1;
      continue;
    }
    const float z = std::min(a, b);
    const float least = law.least_sigmas * std::max(law.sigma_per_m2 * z * z, law.sigma_floor_m);
    if (a < b - least) side[i] = 1;
    if (b < a - least) side[i] = -1;
  }
}

}  // namespace reference
}  // namespace grapnel::kernels
#endif
