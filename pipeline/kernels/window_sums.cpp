#include "pipeline/kernels/window_sums.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pipeline/kernels/window_sums.cpp"
#include "hwy/foreach_target.h"
#include "hwy/highway.h"
#include "pipeline/kernels/moment_sums-inl.h"

HWY_BEFORE_NAMESPACE();
namespace grapnel {
namespace kernels {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

template <bool kFirst>
HWY_INLINE void ScatterLanes(const DensePlanes& planes, std::ptrdiff_t at,
                             const WindowShape& window, float squared_m2, std::ptrdiff_t lane,
                             float (*sums)[kBlock]) {
  const Lanes d;
  const V limit = hn::Set(d, squared_m2);
  const V one = hn::Set(d, 1.0F);
  const V cx = hn::LoadU(d, planes.x + at + lane);
  const V cy = hn::LoadU(d, planes.y + at + lane);
  const V cz = hn::LoadU(d, planes.z + at + lane);
  Sums s = NoSums();
  for (int dv = -window.half_height; dv <= window.half_height; ++dv) {
    const std::ptrdiff_t half = window.half_width[dv < 0 ? -dv : dv];
    const std::ptrdiff_t row = at + lane + dv * planes.stride;
    for (std::ptrdiff_t i = row - half; i <= row + half; ++i) {
      const V dx = hn::Sub(hn::LoadU(d, planes.x + i), cx);
      const V dy = hn::Sub(hn::LoadU(d, planes.y + i), cy);
      const V dz = hn::Sub(hn::LoadU(d, planes.z + i), cz);
      const V squared = hn::Add(hn::Add(hn::Mul(dx, dx), hn::Mul(dy, dy)), hn::Mul(dz, dz));
      const auto inside = hn::Le(squared, limit);
      const V kx = hn::IfThenElseZero(inside, dx);
      const V ky = hn::IfThenElseZero(inside, dy);
      const V kz = hn::IfThenElseZero(inside, dz);
      s.count = hn::Add(s.count, hn::IfThenElseZero(inside, one));
      if (kFirst) {
        s.x = hn::Add(s.x, kx);
        s.y = hn::Add(s.y, ky);
        s.z = hn::Add(s.z, kz);
      }
      AddProducts(kx, ky, kz, s);
    }
  }
  StoreSums(s, lane, sums);
}

void WindowScatter(const DensePlanes& planes, std::ptrdiff_t at, const WindowShape& window,
                   float squared_m2, bool first, float (*sums)[kBlock]) {
  const auto lanes = static_cast<std::ptrdiff_t>(hn::Lanes(Lanes()));
  for (std::ptrdiff_t lane = 0; lane < kBlock; lane += lanes) {
    if (first) {
      ScatterLanes<true>(planes, at, window, squared_m2, lane, sums);
    } else {
      ScatterLanes<false>(planes, at, window, squared_m2, lane, sums);
    }
  }
}

template <bool kAbout>
HWY_INLINE void NormalLanes(const DensePlanes& planes, std::ptrdiff_t at, const WindowShape& window,
                            float squared_m2, std::ptrdiff_t lane, float (*sums)[kBlock]) {
  const Lanes d;
  const V limit = hn::Set(d, squared_m2);
  const V cx = hn::LoadU(d, planes.x + at + lane);
  const V cy = hn::LoadU(d, planes.y + at + lane);
  const V cz = hn::LoadU(d, planes.z + at + lane);
  const V own_x = hn::LoadU(d, planes.nx + at + lane);
  const V own_y = hn::LoadU(d, planes.ny + at + lane);
  const V own_z = hn::LoadU(d, planes.nz + at + lane);
  Sums s = NoSums();
  for (int dv = -window.half_height; dv <= window.half_height; ++dv) {
    const std::ptrdiff_t half = window.half_width[dv < 0 ? -dv : dv];
    const std::ptrdiff_t row = at + lane + dv * planes.stride;
    for (std::ptrdiff_t i = row - half; i <= row + half; ++i) {
      const V dx = hn::Sub(hn::LoadU(d, planes.x + i), cx);
      const V dy = hn::Sub(hn::LoadU(d, planes.y + i), cy);
      const V dz = hn::Sub(hn::LoadU(d, planes.z + i), cz);
      const V squared = hn::Add(hn::Add(hn::Mul(dx, dx), hn::Mul(dy, dy)), hn::Mul(dz, dz));
      const auto inside = hn::Le(squared, limit);
      const V weight = hn::IfThenElseZero(inside, hn::LoadU(d, planes.weight + i));
      V kx = hn::LoadU(d, planes.nx + i);
      V ky = hn::LoadU(d, planes.ny + i);
      V kz = hn::LoadU(d, planes.nz + i);
      if (kAbout) {
        kx = hn::Mul(weight, hn::Sub(kx, own_x));
        ky = hn::Mul(weight, hn::Sub(ky, own_y));
        kz = hn::Mul(weight, hn::Sub(kz, own_z));
      } else {
        kx = hn::IfThenElseZero(inside, kx);
        ky = hn::IfThenElseZero(inside, ky);
        kz = hn::IfThenElseZero(inside, kz);
      }
      s.count = hn::Add(s.count, weight);
      s.x = hn::Add(s.x, kx);
      s.y = hn::Add(s.y, ky);
      s.z = hn::Add(s.z, kz);
      AddProducts(kx, ky, kz, s);
    }
  }
  StoreSums(s, lane, sums);
}

void WindowNormals(const DensePlanes& planes, std::ptrdiff_t at, const WindowShape& window,
                   float squared_m2, bool about, float (*sums)[kBlock]) {
  const auto lanes = static_cast<std::ptrdiff_t>(hn::Lanes(Lanes()));
  for (std::ptrdiff_t lane = 0; lane < kBlock; lane += lanes) {
    if (about) {
      NormalLanes<true>(planes, at, window, squared_m2, lane, sums);
    } else {
      NormalLanes<false>(planes, at, window, squared_m2, lane, sums);
    }
  }
}

/// Points of a vector at position `i` that lie in the range and in the sphere.
HWY_INLINE hn::Mask<Lanes> Inside(const PointPlanes& points, std::int32_t i, std::int32_t end,
                                  const Sphere& sphere) {
  const Lanes d;
  const hn::RebindToSigned<Lanes> di;
  const V dx = hn::Sub(hn::LoadU(d, points.x + i), hn::Set(d, sphere.x));
  const V dy = hn::Sub(hn::LoadU(d, points.y + i), hn::Set(d, sphere.y));
  const V dz = hn::Sub(hn::LoadU(d, points.z + i), hn::Set(d, sphere.z));
  const V squared = hn::Add(hn::Add(hn::Mul(dx, dx), hn::Mul(dy, dy)), hn::Mul(dz, dz));
  const auto in_range = hn::RebindMask(d, hn::Lt(hn::Iota(di, i), hn::Set(di, end)));
  return hn::And(in_range, hn::Le(squared, hn::Set(d, sphere.squared_m2)));
}

bool ExceededWithin(const PointPlanes& points, const float* values,
                    std::span<const PointRange> ranges, const Sphere& sphere, float own) {
  const Lanes d;
  const V mine = hn::Set(d, own);
  const auto lanes = static_cast<std::int32_t>(hn::Lanes(d));
  for (const PointRange& range : ranges) {
    for (std::int32_t i = range.begin; i < range.end; i += lanes) {
      const auto above = hn::Gt(hn::LoadU(d, values + i), mine);
      if (hn::AllFalse(d, above)) continue;
      if (!hn::AllFalse(d, hn::And(above, Inside(points, i, range.end, sphere)))) return true;
    }
  }
  return false;
}

}  // namespace HWY_NAMESPACE
}  // namespace kernels
}  // namespace grapnel
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace grapnel::kernels {

HWY_EXPORT(WindowScatter);
HWY_EXPORT(WindowNormals);
HWY_EXPORT(ExceededWithin);

void window_scatter(const DensePlanes& planes, std::ptrdiff_t at, const WindowShape& window,
                    float squared_m2, bool first, float (*sums)[kBlock]) noexcept {
  HWY_DYNAMIC_DISPATCH(WindowScatter)(planes, at, window, squared_m2, first, sums);
}

void window_normals(const DensePlanes& planes, std::ptrdiff_t at, const WindowShape& window,
                    float squared_m2, bool about, float (*sums)[kBlock]) noexcept {
  HWY_DYNAMIC_DISPATCH(WindowNormals)(planes, at, window, squared_m2, about, sums);
}

bool exceeded_within(const PointPlanes& points, const float* values,
                     std::span<const PointRange> ranges, const Sphere& sphere, float own) noexcept {
  return HWY_DYNAMIC_DISPATCH(ExceededWithin)(points, values, ranges, sphere, own);
}

}  // namespace grapnel::kernels
#endif
