#include "pipeline/kernels/edge_candidates.h"

#include <algorithm>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pipeline/kernels/edge_candidates.cpp"
#include "hwy/foreach_target.h"
#include "hwy/highway.h"

HWY_BEFORE_NAMESPACE();
namespace grapnel {
namespace kernels {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/// Of whole vectors only. Returns the number of positions looked at.
std::size_t EdgeCandidates(const LabelledRow& row, std::size_t count, const EdgeLaw& law,
                           std::int32_t* found, std::size_t& made) {
  const hn::CappedTag<float, kCandidatePad> d;
  const hn::RebindToSigned<decltype(d)> di;
  const hn::Rebind<std::uint16_t, decltype(d)> d16;
  const hn::Rebind<std::uint8_t, decltype(d)> d8;
  const auto none = hn::Zero(di);
  const auto unit = hn::Set(d, law.metres_per_unit);
  const auto per_m2 = hn::Set(d, law.sigma_per_m2);
  const auto floor = hn::Set(d, law.sigma_floor_m);
  const auto sigmas = hn::Set(d, 8.0F);
  const auto steepest = hn::Set(d, 6.0F);
  const auto fx = hn::Set(d, law.fx);
  const auto counts = [&](const std::uint16_t* at) {
    return hn::PromoteTo(di, hn::LoadU(d16, at));
  };
  const auto labels = [&](const std::uint8_t* at) { return hn::PromoteTo(di, hn::LoadU(d8, at)); };
  std::size_t i = 0;
  for (; i + hn::Lanes(d) <= count; i += hn::Lanes(d)) {
    const std::uint16_t* const at = row.depth + i;
    const auto own = counts(at);
    auto there = hn::Gt(own, none);
    const std::uint8_t* const label = row.label != nullptr ? row.label + i : nullptr;
    if (label != nullptr) there = hn::And(there, hn::Gt(labels(label), none));
    if (hn::AllFalse(di, there)) continue;
    const auto before = counts(at - 1);
    const auto after = counts(at + 1);
    const auto above = counts(at - row.depth_stride);
    const auto below = counts(at + row.depth_stride);
    const auto nearest = hn::Min(hn::Min(before, after), hn::Min(above, below));
    const auto farthest = hn::Max(hn::Max(before, after), hn::Max(above, below));
    const auto z = hn::Mul(unit, hn::ConvertTo(d, own));
    const auto sigma = hn::Max(hn::Mul(hn::Mul(per_m2, z), z), floor);
    const auto step = hn::Add(hn::Mul(sigmas, sigma), hn::Div(hn::Mul(steepest, z), fx));
    const auto limit = hn::Add(z, step);
    auto goes_on =
        hn::And(hn::Gt(nearest, none),
                hn::RebindMask(di, hn::Le(hn::Mul(unit, hn::ConvertTo(d, farthest)), limit)));
    if (label != nullptr) {
      const auto beside =
          hn::Min(hn::Min(labels(label - 1), labels(label + 1)),
                  hn::Min(labels(label - row.label_stride), labels(label + row.label_stride)));
      goes_on = hn::And(goes_on, hn::Gt(beside, none));
    }
    const auto candidate = hn::AndNot(goes_on, there);
    if (hn::AllFalse(di, candidate)) continue;
    made +=
        hn::CompressStore(hn::Iota(di, static_cast<std::int32_t>(i)), candidate, di, found + made);
  }
  return i;
}

}  // namespace HWY_NAMESPACE
}  // namespace kernels
}  // namespace grapnel
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace grapnel::kernels {
namespace {

std::size_t look_at_each(const LabelledRow& row, std::size_t first, std::size_t count,
                         const EdgeLaw& law, std::int32_t* found) noexcept {
  std::size_t made = 0;
  for (std::size_t i = first; i < count; ++i) {
    const std::uint16_t* const at = row.depth + i;
    const std::uint8_t* const label = row.label != nullptr ? row.label + i : nullptr;
    if (*at == 0 || (label != nullptr && *label == 0)) continue;
    const float z = law.metres_per_unit * static_cast<float>(*at);
    const float limit = z + edge_step_m(law, z);
    bool goes_on = true;
    for (const std::ptrdiff_t way : {std::ptrdiff_t{-1}, std::ptrdiff_t{1}}) {
      for (const std::uint16_t beside : {at[way], at[way * row.depth_stride]}) {
        const float z_beside = law.metres_per_unit * static_cast<float>(beside);
        goes_on = goes_on && beside != 0 && z_beside <= limit;
      }
      if (label == nullptr) continue;
      goes_on = goes_on && label[way] != 0 && label[way * row.label_stride] != 0;
    }
    if (!goes_on) found[made++] = static_cast<std::int32_t>(i);
  }
  return made;
}

}  // namespace

HWY_EXPORT(EdgeCandidates);

std::size_t edge_candidates(const LabelledRow& row, std::size_t count, const EdgeLaw& law,
                            std::int32_t* found) noexcept {
  std::size_t made = 0;
  const std::size_t done = HWY_DYNAMIC_DISPATCH(EdgeCandidates)(row, count, law, found, made);
  return made + look_at_each(row, done, count, law, found + made);
}

namespace reference {

std::size_t edge_candidates(const LabelledRow& row, std::size_t count, const EdgeLaw& law,
                            std::int32_t* found) noexcept {
  return look_at_each(row, 0, count, law, found);
}

}  // namespace reference
}  // namespace grapnel::kernels
#endif
