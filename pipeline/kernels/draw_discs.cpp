#include "pipeline/kernels/draw_discs.h"

#include <algorithm>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pipeline/kernels/draw_discs.cpp"
#include "hwy/foreach_target.h"
#include "hwy/highway.h"

HWY_BEFORE_NAMESPACE();
namespace grapnel {
namespace kernels {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

void DrawDiscs(const Disc* discs, std::size_t count, const DiscImage& image) {
  const hn::CappedTag<float, kDiscPad> d;
  const hn::RebindToSigned<decltype(d)> di;
  const auto lanes = static_cast<std::int32_t>(hn::Lanes(d));
  for (std::size_t i = 0; i < count; ++i) {
    const Disc& disc = discs[i];
    const auto step_u = hn::Set(d, disc.step_u);
    const auto nearest = hn::Set(d, disc.nearest);
    const auto farthest = hn::Set(d, disc.farthest);
    const auto point = hn::Set(di, disc.point);
    for (std::int32_t u = disc.u0; u <= disc.u1; u += lanes) {
      const auto along = hn::Mul(step_u, hn::Iota(d, static_cast<float>(u)));
      const auto inside = hn::FirstN(d, static_cast<std::size_t>(disc.u1 + 1 - u));
      std::ptrdiff_t k =
          static_cast<std::ptrdiff_t>(disc.v0 - image.top) * image.width - image.left + u;
      for (std::int32_t v = disc.v0; v <= disc.v1; ++v, k += image.width) {
        const auto row = hn::Set(d, disc.start + disc.step_v * static_cast<float>(v));
        const auto value = hn::Min(hn::Max(hn::Add(row, along), farthest), nearest);
        const auto before = hn::LoadU(d, image.inverse_z + k);
        const auto nearer = hn::And(inside, hn::Lt(before, value));
        // Whole vectors: stores of single lanes are slow on some processors.
        hn::StoreU(hn::IfThenElse(nearer, value, before), d, image.inverse_z + k);
        hn::StoreU(
            hn::IfThenElse(hn::RebindMask(di, nearer), point, hn::LoadU(di, image.point + k)), di,
            image.point + k);
      }
    }
  }
}

float InvertRow(float* row, std::size_t count) {
  const hn::CappedTag<float, kDiscPad> d;
  const auto zero = hn::Zero(d);
  const auto one = hn::Set(d, 1.0F);
  auto largest = zero;
  for (std::size_t i = 0; i < count; i += hn::Lanes(d)) {
    const auto value = hn::LoadU(d, row + i);
    const auto mine = hn::FirstN(d, count - i);
    const auto there = hn::Gt(value, zero);
    const auto inverse = hn::IfThenElseZero(there, hn::Div(one, value));
    largest = hn::Max(largest, hn::IfThenElseZero(mine, value));
    hn::StoreU(hn::IfThenElse(mine, inverse, value), d, row + i);
  }
  return hn::GetLane(hn::MaxOfLanes(d, largest));
}

}  // namespace HWY_NAMESPACE
}  // namespace kernels
}  // namespace grapnel
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace grapnel::kernels {

HWY_EXPORT(DrawDiscs);
HWY_EXPORT(InvertRow);

float invert_row(float* row, std::size_t count) noexcept {
  return HWY_DYNAMIC_DISPATCH(InvertRow)(row, count);
}

void draw_discs(const Disc* discs, std::size_t count, const DiscImage& image) noexcept {
  HWY_DYNAMIC_DISPATCH(DrawDiscs)(discs, count, image);
}

namespace reference {

float invert_row(float* row, std::size_t count) noexcept {
  float largest = 0.0F;
  for (std::size_t i = 0; i < count; ++i) {
    largest = std::max(largest, row[i]);
    row[i] = row[i] > 0.0F ? 1.0F / row[i] : 0.0F;
  }
  return largest;
}

void draw_discs(const Disc* discs, std::size_t count, const DiscImage& image) noexcept {
  for (std::size_t i = 0; i < count; ++i) {
    const Disc& disc = discs[i];
    for (std::int32_t v = disc.v0; v <= disc.v1; ++v) {
      const float row = disc.start + disc.step_v * static_cast<float>(v);
      const std::ptrdiff_t line =
          static_cast<std::ptrdiff_t>(v - image.top) * image.width - image.left;
      for (std::int32_t u = disc.u0; u <= disc.u1; ++u) {
        const float value =
            std::clamp(row + disc.step_u * static_cast<float>(u), disc.farthest, disc.nearest);
        if (image.inverse_z[line + u] >= value) continue;
        image.inverse_z[line + u] = value;
        image.point[line + u] = disc.point;
      }
    }
  }
}

}  // namespace reference
}  // namespace grapnel::kernels
#endif
