#include "pipeline/kernels/label_rows.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pipeline/kernels/label_rows.cpp"
#include "hwy/foreach_target.h"
#include "hwy/highway.h"

HWY_BEFORE_NAMESPACE();
namespace grapnel {
namespace kernels {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::CappedTag<float, 8>;
using Ints = hn::RebindToSigned<Floats>;
using Depths = hn::Rebind<std::uint16_t, Floats>;
using Labels = hn::Rebind<std::uint8_t, Floats>;

/// All ones in the labels to be kept, of a vector of readings from pixel u on.
HWY_INLINE hn::Vec<Labels> Above(hn::Vec<Depths> depth, std::int32_t u, const PlaneRow& plane,
                                 const HeightLaw& law) {
  const Floats d;
  const Ints di;
  const auto depth_m =
      hn::Mul(hn::ConvertTo(d, hn::PromoteTo(di, depth)), hn::Set(d, plane.metres_per_unit));
  const auto column = hn::ConvertTo(d, hn::Iota(di, u));
  // Height n·p + offset = offset (1 - z q) with q = 1/z of the plane on this ray. Depth noise
  // z² sigma tilts it by offset z sigma.
  const auto inverse = hn::Add(hn::Set(d, plane.start), hn::Mul(hn::Set(d, plane.a), column));
  const auto above_m =
      hn::Mul(hn::Set(d, plane.offset_m), hn::Sub(hn::Set(d, 1.0F), hn::Mul(depth_m, inverse)));
  const auto noise_m = hn::Mul(hn::Set(d, law.noise * plane.offset_m), depth_m);
  const auto least_m = hn::Max(hn::Set(d, law.height_m), hn::Mul(hn::Set(d, law.ratio), depth_m));
  const auto above = hn::RebindMask(di, hn::Gt(above_m, hn::Max(noise_m, least_m)));
  return hn::DemoteTo(Labels(), hn::IfThenElseZero(above, hn::Set(di, 255)));
}

void KeepAbovePlane(const std::uint16_t* HWY_RESTRICT depth, std::size_t count,
                    const PlaneRow& plane, const HeightLaw& law, std::uint8_t* HWY_RESTRICT label) {
  const Depths dd;
  const Labels dl;
  const std::size_t lanes = hn::Lanes(dd);
  std::size_t u = 0;
  for (; u + lanes <= count; u += lanes) {
    const auto kept = Above(hn::LoadU(dd, depth + u), static_cast<std::int32_t>(u), plane, law);
    hn::StoreU(hn::And(hn::LoadU(dl, label + u), kept), dl, label + u);
  }
  if (u == count) return;
  std::uint16_t last[8] = {};
  std::uint8_t kept[8] = {};
  for (std::size_t k = 0; u + k < count; ++k) last[k] = depth[u + k];
  hn::StoreU(Above(hn::LoadU(dd, last), static_cast<std::int32_t>(u), plane, law), dl, kept);
  for (std::size_t k = 0; u + k < count; ++k) label[u + k] &= kept[k];
}

std::size_t CopyInRange(const std::uint16_t* HWY_RESTRICT from, std::size_t count,
                        std::uint16_t least, std::uint16_t most, std::uint8_t label,
                        std::uint16_t* HWY_RESTRICT depth, std::uint8_t* HWY_RESTRICT labels) {
  const hn::CappedTag<std::uint16_t, 16> d;
  const hn::RebindToSigned<decltype(d)> di;
  const hn::Rebind<std::uint8_t, decltype(d)> dl;
  const auto low = hn::Set(d, least);
  const auto high = hn::Set(d, most);
  const auto own = hn::Set(d, std::uint16_t{label});
  const std::size_t lanes = hn::Lanes(d);
  std::size_t kept = 0;
  std::size_t i = 0;
  for (; i + lanes <= count; i += lanes) {
    const auto reading = hn::LoadU(d, from + i);
    const auto valid =
        hn::And(hn::Eq(hn::Max(reading, low), reading), hn::Eq(hn::Min(reading, high), reading));
    hn::StoreU(hn::IfThenElseZero(valid, reading), d, depth + i);
    const auto labelled = hn::BitCast(di, hn::IfThenElseZero(valid, own));
    hn::StoreU(hn::DemoteTo(dl, labelled), dl, labels + i);
    kept += hn::CountTrue(d, valid);
  }
  for (; i < count; ++i) {
    const bool valid = from[i] >= least && from[i] <= most;
    depth[i] = valid ? from[i] : std::uint16_t{0};
    labels[i] = valid ? label : std::uint8_t{0};
    kept += valid ? 1U : 0U;
  }
  return kept;
}

}  // namespace HWY_NAMESPACE
}  // namespace kernels
}  // namespace grapnel
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace grapnel::kernels {

HWY_EXPORT(KeepAbovePlane);
HWY_EXPORT(CopyInRange);

void keep_above_plane(const std::uint16_t* depth, std::size_t count, const PlaneRow& plane,
                      const HeightLaw& law, std::uint8_t* label) noexcept {
  HWY_DYNAMIC_DISPATCH(KeepAbovePlane)(depth, count, plane, law, label);
}

std::size_t copy_in_range(const std::uint16_t* from, std::size_t count, std::uint16_t least,
                          std::uint16_t most, std::uint8_t label, std::uint16_t* depth,
                          std::uint8_t* labels) noexcept {
  return HWY_DYNAMIC_DISPATCH(CopyInRange)(from, count, least, most, label, depth, labels);
}

}  // namespace grapnel::kernels
#endif
