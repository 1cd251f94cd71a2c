#include "pipeline/kernels/window_planes.h"

#include <algorithm>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pipeline/kernels/window_planes.cpp"
#include "hwy/foreach_target.h"
#include "hwy/highway.h"

HWY_BEFORE_NAMESPACE();
namespace grapnel {
namespace kernels {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Lanes = hn::CappedTag<float, 8>;
using V = hn::Vec<Lanes>;

HWY_INLINE V Number(float value) { return hn::Set(Lanes(), value); }

// More than any inverse depth.
constexpr float kHuge = 1e30F;
// Determinant of a window's second moments over the product of its diagonal: below, it is a line…
constexpr float kLine = 0.02F;
// …and it has no fewer readings than this.
constexpr float kFewest = 5.0F;

struct Reading {
  V inverse, there, low;
};
HWY_INLINE Reading Read(const float* at) {
  const Lanes d;
  const V inverse = hn::LoadU(d, at);
  const auto there = hn::Gt(inverse, hn::Zero(d));
  return {inverse, hn::IfThenElseZero(there, Number(1.0F)),
          hn::IfThenElse(there, inverse, Number(kHuge))};
}

bool Empty(const float* inverse_m, std::ptrdiff_t count) {
  const Lanes d;
  V any = hn::Zero(d);
  for (std::ptrdiff_t i = 0; i < count; i += static_cast<std::ptrdiff_t>(hn::Lanes(d))) {
    any = hn::Max(any, hn::LoadU(d, inverse_m + i));
  }
  return hn::AllTrue(d, hn::Le(any, hn::Zero(d)));
}

void SumRow(const float* inverse_m, int reach, RowSums& sums) {
  const Lanes d;
  if (Empty(inverse_m - reach, static_cast<std::ptrdiff_t>(kStrip) + 2 * reach)) {
    for (float* plane : {sums.count, sums.offset, sums.square, sums.inverse, sums.energy,
                         sums.moment, sums.most}) {
      std::fill_n(plane, kStrip, 0.0F);
    }
    std::fill_n(sums.least, kStrip, kHuge);
    return;
  }
  for (std::size_t i = 0; i < kStrip; i += hn::Lanes(d)) {
    const float* const at = inverse_m + i;
    const Reading own = Read(at);
    V count = own.there;
    V offset = hn::Zero(d);
    V square = hn::Zero(d);
    V inverse = own.inverse;
    V energy = hn::Mul(own.inverse, own.inverse);
    V moment = hn::Zero(d);
    V least = own.low;
    V most = own.inverse;
    for (int k = 1; k <= reach; ++k) {
      const Reading left = Read(at - k);
      const Reading right = Read(at + k);
      const V far = Number(static_cast<float>(k));
      const V both = hn::Add(left.there, right.there);
      count = hn::Add(count, both);
      offset = hn::Add(offset, hn::Mul(far, hn::Sub(right.there, left.there)));
      square = hn::Add(square, hn::Mul(Number(static_cast<float>(k * k)), both));
      inverse = hn::Add(inverse, hn::Add(left.inverse, right.inverse));
      energy = hn::Add(energy, hn::Add(hn::Mul(left.inverse, left.inverse),
                                       hn::Mul(right.inverse, right.inverse)));
      moment = hn::Add(moment, hn::Mul(far, hn::Sub(right.inverse, left.inverse)));
      least = hn::Min(least, hn::Min(left.low, right.low));
      most = hn::Max(most, hn::Max(left.inverse, right.inverse));
    }
    hn::Store(count, d, sums.count + i);
    hn::Store(offset, d, sums.offset + i);
    hn::Store(square, d, sums.square + i);
    hn::Store(inverse, d, sums.inverse + i);
    hn::Store(energy, d, sums.energy + i);
    hn::Store(moment, d, sums.moment + i);
    hn::Store(least, d, sums.least + i);
    hn::Store(most, d, sums.most + i);
  }
}

/// Sums over a window, offsets counted from its middle.
struct Window {
  V count, u, v, uu, uv, vv, w, ww, uw, vw, least, most;
};
HWY_INLINE Window SumWindow(const RowSums* const* rows, int reach, std::size_t i) {
  const Lanes d;
  const V zero = hn::Zero(d);
  Window s = {zero, zero, zero, zero, zero, zero, zero, zero, zero, zero, Number(kHuge), zero};
  for (int k = -reach; k <= reach; ++k) {
    const RowSums& row = *rows[k + reach];
    const V far = Number(static_cast<float>(k));
    const V count = hn::Load(d, row.count + i);
    const V u = hn::Load(d, row.offset + i);
    const V w = hn::Load(d, row.inverse + i);
    const V v = hn::Mul(far, count);
    s.count = hn::Add(s.count, count);
    s.u = hn::Add(s.u, u);
    s.v = hn::Add(s.v, v);
    s.uu = hn::Add(s.uu, hn::Load(d, row.square + i));
    s.uv = hn::Add(s.uv, hn::Mul(far, u));
    s.vv = hn::Add(s.vv, hn::Mul(far, v));
    s.w = hn::Add(s.w, w);
    s.ww = hn::Add(s.ww, hn::Load(d, row.energy + i));
    s.uw = hn::Add(s.uw, hn::Load(d, row.moment + i));
    s.vw = hn::Add(s.vw, hn::Mul(far, w));
    s.least = hn::Min(s.least, hn::Load(d, row.least + i));
    s.most = hn::Max(s.most, hn::Load(d, row.most + i));
  }
  return s;
}

void FitWindowPlanes(const RowSums* const* rows, int reach, const float* inverse_m,
                     const StripPlace& place, float* HWY_RESTRICT nx, float* HWY_RESTRICT ny,
                     float* HWY_RESTRICT nz) {
  const Lanes d;
  const hn::RebindToSigned<Lanes> di;
  const V one = Number(1.0F);
  for (std::size_t i = 0; i < kStrip; i += hn::Lanes(d)) {
    const V own = hn::LoadU(d, inverse_m + i);
    if (hn::AllTrue(d, hn::Le(own, hn::Zero(d)))) {
      for (float* plane : {nx, ny, nz}) hn::StoreU(hn::Zero(d), d, plane + i);
      continue;
    }
    const Window s = SumWindow(rows, reach, i);
    const V by = hn::Div(one, hn::Max(s.count, one));
    const V mean_u = hn::Mul(s.u, by);
    const V mean_v = hn::Mul(s.v, by);
    const V mean_w = hn::Mul(s.w, by);
    const V uu = hn::Sub(s.uu, hn::Mul(mean_u, s.u));
    const V uv = hn::Sub(s.uv, hn::Mul(mean_u, s.v));
    const V vv = hn::Sub(s.vv, hn::Mul(mean_v, s.v));
    const V uw = hn::Sub(s.uw, hn::Mul(mean_w, s.u));
    const V vw = hn::Sub(s.vw, hn::Mul(mean_w, s.v));
    const V full = hn::Mul(uu, vv);
    const V determinant = hn::Sub(full, hn::Mul(uv, uv));
    const auto flat =
        hn::And(hn::Gt(own, hn::Zero(d)),
                hn::Le(hn::Sub(s.most, s.least), hn::Mul(Number(place.max_span), own)));
    const auto wide = hn::And(hn::Ge(s.count, Number(kFewest)),
                              hn::Gt(determinant, hn::Mul(Number(kLine), full)));
    const V over = hn::Div(one, hn::Max(determinant, Number(1e-6F)));
    const V slope_u = hn::Mul(hn::Sub(hn::Mul(uw, vv), hn::Mul(vw, uv)), over);
    const V slope_v = hn::Mul(hn::Sub(hn::Mul(vw, uu), hn::Mul(uw, uv)), over);
    // What the plane leaves of the squares about the mean.
    const V left = hn::Sub(hn::Sub(hn::Sub(s.ww, hn::Mul(mean_w, s.w)), hn::Mul(slope_u, uw)),
                           hn::Mul(slope_v, vw));
    const V off = hn::Mul(Number(place.max_off), own);
    const auto even = hn::Le(left, hn::Mul(hn::Mul(off, off), s.count));
    const V middle = hn::Sub(hn::Sub(mean_w, hn::Mul(slope_u, mean_u)), hn::Mul(slope_v, mean_v));
    // 1/z = middle + slope_u (u' - u) + slope_v (v' - v), times z: the plane's coefficients.
    const V u = hn::Add(Number(place.first_u),
                        hn::ConvertTo(d, hn::Iota(di, static_cast<std::int32_t>(i))));
    const V x = hn::Mul(slope_u, Number(place.fx));
    const V y = hn::Mul(slope_v, Number(place.fy));
    const V z = hn::Sub(hn::Sub(middle, hn::Mul(slope_u, u)), hn::Mul(slope_v, Number(place.v)));
    const V square = hn::Add(hn::Add(hn::Mul(x, x), hn::Mul(y, y)), hn::Mul(z, z));
    const auto sound = hn::And(hn::And(flat, wide), even);
    const V scale = hn::Div(Number(-1.0F), hn::Sqrt(hn::Max(square, Number(1e-30F))));
    hn::StoreU(hn::IfThenElseZero(sound, hn::Mul(x, scale)), d, nx + i);
    hn::StoreU(hn::IfThenElseZero(sound, hn::Mul(y, scale)), d, ny + i);
    hn::StoreU(hn::IfThenElseZero(sound, hn::Mul(z, scale)), d, nz + i);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace kernels
}  // namespace grapnel
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace grapnel::kernels {

HWY_EXPORT(SumRow);
HWY_EXPORT(FitWindowPlanes);

void sum_row(const float* inverse_m, int reach, RowSums& sums) noexcept {
  HWY_DYNAMIC_DISPATCH(SumRow)(inverse_m, reach, sums);
}

void fit_window_planes(const RowSums* const* rows, int reach, const float* inverse_m,
                       const StripPlace& place, float* nx, float* ny, float* nz) noexcept {
  HWY_DYNAMIC_DISPATCH(FitWindowPlanes)(rows, reach, inverse_m, place, nx, ny, nz);
}

}  // namespace grapnel::kernels
#endif
