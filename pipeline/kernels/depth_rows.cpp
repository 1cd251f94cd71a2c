#include "pipeline/kernels/depth_rows.h"

#include <algorithm>
#include <array>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pipeline/kernels/depth_rows.cpp"
#include "hwy/foreach_target.h"
#include "hwy/highway.h"

HWY_BEFORE_NAMESPACE();
namespace grapnel {
namespace kernels {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/// Allowed steps around kDepthSlack depths, saturated to 16 bits.
HWY_INLINE void AllowedSteps(const std::uint16_t* centre, const GapLaw& law, std::uint16_t* out) {
  const hn::CappedTag<float, 8> df;
  const hn::RebindToSigned<decltype(df)> di;
  const hn::Rebind<std::uint16_t, decltype(df)> du;
  const auto linear = hn::Set(df, law.linear);
  const auto quadratic = hn::Set(df, law.quadratic);
  const auto one = hn::Set(di, 1);
  for (std::size_t i = 0; i < kDepthSlack; i += hn::Lanes(df)) {
    const auto depth = hn::ConvertTo(df, hn::PromoteTo(di, hn::LoadU(du, centre + i)));
    const auto slope = hn::Add(linear, hn::Mul(quadratic, depth));
    const auto step = hn::Add(hn::ConvertTo(di, hn::Mul(depth, slope)), one);
    hn::StoreU(hn::DemoteTo(du, step), du, out + i);
  }
}

std::size_t SupportRow(const std::uint16_t* above, const std::uint16_t* row,
                       const std::uint16_t* below, const GapLaw& gap, int min_support,
                       std::size_t width, std::uint16_t* out) {
  const hn::CappedTag<std::uint16_t, kDepthSlack> d;
  using V = hn::Vec<decltype(d)>;
  const std::size_t lanes = hn::Lanes(d);
  const V zero = hn::Zero(d);
  const V wanted = hn::Set(d, static_cast<std::uint16_t>(min_support));
  const std::uint16_t* const from[3] = {above, row, below};
  std::size_t removed = 0;
  HWY_ALIGN std::array<std::uint16_t, kDepthSlack> last;
  HWY_ALIGN std::array<std::uint16_t, kDepthSlack> steps;
  for (std::size_t u = 0; u < width; u += lanes) {
    if (u % kDepthSlack == 0) AllowedSteps(row + u + 1, gap, steps.data());
    const V centre = hn::LoadU(d, row + u + 1);
    const V allowed = hn::LoadU(d, steps.data() + u % kDepthSlack);
    V support = zero;
    for (int i = 0; i < 9; ++i) {
      if (i == 4) continue;
      const V other = hn::LoadU(d, from[i / 3] + u + static_cast<std::size_t>(i % 3));
      const V step = hn::Sub(hn::Max(centre, other), hn::Min(centre, other));
      const auto near = hn::And(hn::Ne(other, zero), hn::Eq(hn::Min(step, allowed), step));
      support = hn::Sub(support, hn::VecFromMask(d, near));
    }
    const auto lonely = hn::And(hn::Ne(centre, zero), hn::Eq(hn::Max(support, wanted), wanted));
    const auto drop = hn::And(lonely, hn::Ne(support, wanted));
    const V kept = hn::IfThenZeroElse(drop, centre);
    const std::size_t valid = std::min(lanes, width - u);
    if (valid == lanes) {
      hn::StoreU(kept, d, out + u);
      removed += hn::CountTrue(d, drop);
    } else {
      hn::StoreU(kept, d, last.data());
      std::copy_n(last.begin(), valid, out + u);
      removed += hn::CountTrue(d, hn::And(drop, hn::FirstN(d, valid)));
    }
  }
  return removed;
}

void BackProjectRow(const std::uint16_t* depth, const RowCamera& camera, std::size_t width,
                    float* x, float* y, float* z) {
  const hn::CappedTag<float, 8> df;
  const hn::RebindToSigned<decltype(df)> di;
  const hn::Rebind<std::uint16_t, decltype(df)> du;
  const std::size_t lanes = hn::Lanes(df);
  const auto unit = hn::Set(df, camera.metres_per_unit);
  const auto inverse_fx = hn::Set(df, camera.inverse_fx);
  const auto cx = hn::Set(df, camera.cx);
  const auto y_over_z = hn::Set(df, camera.y_over_z);
  const auto count_up = hn::Iota(df, 0.0F);
  HWY_ALIGN std::array<std::uint16_t, 8> last{};
  for (std::size_t u = 0; u < width; u += lanes) {
    const std::uint16_t* from = depth + u;
    if (u + lanes > width) {
      std::copy_n(depth + u, width - u, last.begin());
      from = last.data();
    }
    const auto column = hn::Add(hn::Set(df, static_cast<float>(u)), count_up);
    const auto depth_m = hn::Mul(hn::ConvertTo(df, hn::PromoteTo(di, hn::LoadU(du, from))), unit);
    hn::StoreU(hn::Mul(hn::Mul(hn::Sub(column, cx), inverse_fx), depth_m), df, x + u);
    hn::StoreU(hn::Mul(y_over_z, depth_m), df, y + u);
    hn::StoreU(depth_m, df, z + u);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace kernels
}  // namespace grapnel
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace grapnel::kernels {

HWY_EXPORT(SupportRow);
HWY_EXPORT(BackProjectRow);

std::size_t support_row(const std::uint16_t* above, const std::uint16_t* row,
                        const std::uint16_t* below, const GapLaw& gap, int min_support,
                        std::size_t width, std::uint16_t* out) noexcept {
  return HWY_DYNAMIC_DISPATCH(SupportRow)(above, row, below, gap, min_support, width, out);
}

void back_project_row(const std::uint16_t* depth, const RowCamera& camera, std::size_t width,
                      float* x, float* y, float* z) noexcept {
  HWY_DYNAMIC_DISPATCH(BackProjectRow)(depth, camera, width, x, y, z);
}

}  // namespace grapnel::kernels
#endif
