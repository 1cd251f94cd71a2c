#include "pipeline/kernels/plane_fit.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pipeline/kernels/plane_fit.cpp"
#include "hwy/foreach_target.h"
#include "hwy/highway.h"

HWY_BEFORE_NAMESPACE();
namespace grapnel {
namespace kernels {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

void FitPlanes(const FitRow& row, std::size_t count, float* HWY_RESTRICT nx, float* HWY_RESTRICT ny,
               float* HWY_RESTRICT nz) {
  const hn::CappedTag<float, kLanes> d;
  const hn::RebindToSigned<decltype(d)> di;
  constexpr float kWidth = 2 * kFitReach + 1;
  // Sums of du² over the window: 10 a row of five, in five rows.
  constexpr float kSquares = 50.0F;
  const auto zero = hn::Zero(d);
  for (std::size_t i = 0; i < in_lanes(count); i += hn::Lanes(d)) {
    auto sum = zero;
    auto along_u = zero;
    auto along_v = zero;
    auto low = hn::Set(d, 1e30F);
    auto high = zero;
    for (int dv = -kFitReach; dv <= kFitReach; ++dv) {
      const float* at = row.inverse_m + dv * row.stride + static_cast<std::ptrdiff_t>(i);
      const auto a = hn::LoadU(d, at - 2);
      const auto b = hn::LoadU(d, at - 1);
      const auto c = hn::LoadU(d, at);
      const auto e = hn::LoadU(d, at + 1);
      const auto f = hn::LoadU(d, at + 2);
      const auto across = hn::Add(hn::Add(hn::Add(a, f), hn::Add(b, e)), c);
      sum = hn::Add(sum, across);
      along_v = hn::Add(along_v, hn::Mul(hn::Set(d, static_cast<float>(dv)), across));
      const auto outer = hn::Sub(f, a);
      along_u = hn::Add(along_u, hn::Add(hn::Add(outer, outer), hn::Sub(e, b)));
      low = hn::Min(low, hn::Min(hn::Min(hn::Min(a, b), hn::Min(c, e)), f));
      high = hn::Max(high, hn::Max(hn::Max(hn::Max(a, b), hn::Max(c, e)), f));
    }
    const auto mean = hn::Mul(sum, hn::Set(d, 1.0F / (kWidth * kWidth)));
    const auto slope_u = hn::Mul(along_u, hn::Set(d, 1.0F / kSquares));
    const auto slope_v = hn::Mul(along_v, hn::Set(d, 1.0F / kSquares));
    const auto one_surface = hn::And(
        hn::Gt(low, zero), hn::Le(hn::Sub(high, low), hn::Mul(hn::Set(d, row.max_step), mean)));
    // 1/z = mean + slope_u (u' - u) + slope_v (v' - v), times z: the plane's coefficients.
    const auto u = hn::Add(hn::Set(d, row.first_u),
                           hn::ConvertTo(d, hn::Iota(di, static_cast<std::int32_t>(i))));
    const auto x = hn::Mul(slope_u, hn::Set(d, row.fx));
    const auto y = hn::Mul(slope_v, hn::Set(d, row.fy));
    const auto z = hn::Sub(hn::Sub(mean, hn::Mul(slope_u, u)), hn::Mul(slope_v, hn::Set(d, row.v)));
    const auto square = hn::Add(hn::Add(hn::Mul(x, x), hn::Mul(y, y)), hn::Mul(z, z));
    const auto scale = hn::IfThenElseZero(
        hn::And(one_surface, hn::Gt(square, zero)),
        hn::Div(hn::Set(d, -1.0F), hn::Sqrt(hn::Max(square, hn::Set(d, 1e-30F)))));
    hn::StoreU(hn::Mul(x, scale), d, nx + i);
    hn::StoreU(hn::Mul(y, scale), d, ny + i);
    hn::StoreU(hn::Mul(z, scale), d, nz + i);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace kernels
}  // namespace grapnel
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace grapnel::kernels {

HWY_EXPORT(FitPlanes);

void fit_planes(const FitRow& row, std::size_t count, float* nx, float* ny, float* nz) noexcept {
  HWY_DYNAMIC_DISPATCH(FitPlanes)(row, count, nx, ny, nz);
}

}  // namespace grapnel::kernels
#endif
