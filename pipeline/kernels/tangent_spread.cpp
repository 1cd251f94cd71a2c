#include "pipeline/kernels/tangent_spread.h"

#include <algorithm>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pipeline/kernels/tangent_spread.cpp"
#include "hwy/foreach_target.h"
#include "hwy/highway.h"

HWY_BEFORE_NAMESPACE();
namespace grapnel {
namespace kernels {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Doubles = hn::CappedTag<double, kEigenBlock>;
using Floats = hn::Rebind<float, Doubles>;
using D = hn::Vec<Doubles>;

HWY_INLINE D Load(const float* from) { return hn::PromoteTo(Doubles(), hn::LoadU(Floats(), from)); }
HWY_INLINE void Store(D value, float* to) {
  hn::StoreU(hn::DemoteTo(Floats(), value), Floats(), to);
}

struct Vector {
  D x, y, z;
};
HWY_INLINE D Dot(const Vector& a, const Vector& b) {
  return hn::Add(hn::Add(hn::Mul(a.x, b.x), hn::Mul(a.y, b.y)), hn::Mul(a.z, b.z));
}
HWY_INLINE D Minor(D a, D b, D c, D d) { return hn::Sub(hn::Mul(a, b), hn::Mul(c, d)); }
HWY_INLINE Vector Cross(const Vector& a, const Vector& b) {
  return {Minor(a.y, b.z, a.z, b.y), Minor(a.z, b.x, a.x, b.z), Minor(a.x, b.y, a.y, b.x)};
}
HWY_INLINE Vector Scaled(const Vector& a, D by) {
  return {hn::Mul(a.x, by), hn::Mul(a.y, by), hn::Mul(a.z, by)};
}
HWY_INLINE Vector Plus(const Vector& a, const Vector& b) {
  return {hn::Add(a.x, b.x), hn::Add(a.y, b.y), hn::Add(a.z, b.z)};
}
HWY_INLINE D Inverse(D value) {
  const D one = hn::Set(Doubles(), 1.0);
  return hn::Div(one, hn::IfThenElse(hn::Gt(value, hn::Zero(Doubles())), value, one));
}

/// Across a unit vector, unit.
HWY_INLINE Vector Across(const Vector& n) {
  const D zero = hn::Zero(Doubles());
  // Of two choices the one that is longer than a half.
  const auto about_x = hn::Le(hn::Abs(n.x), hn::Abs(n.z));
  const Vector v = {hn::IfThenElse(about_x, zero, hn::Neg(n.y)),
                    hn::IfThenElse(about_x, hn::Neg(n.z), n.x), hn::IfThenElse(about_x, n.y, zero)};
  return Scaled(v, Inverse(hn::Sqrt(Dot(v, v))));
}

struct Covariance {
  Vector row[3];
  [[nodiscard]] HWY_INLINE Vector Times(const Vector& p) const {
    return {Dot(row[0], p), Dot(row[1], p), Dot(row[2], p)};
  }
};
HWY_INLINE Covariance CovarianceOf(const TangentSums& sums, std::size_t i) {
  const D by = Inverse(Load(sums.count + i));
  const Vector mean =
      Scaled({Load(sums.first[0] + i), Load(sums.first[1] + i), Load(sums.first[2] + i)}, by);
  const auto entry = [&](const float* products, D a, D b) {
    return hn::Sub(hn::Mul(Load(products + i), by), hn::Mul(a, b));
  };
  const SymmetricPlanes& p = sums.products;
  const D xx = entry(p.xx, mean.x, mean.x);
  const D xy = entry(p.xy, mean.x, mean.y);
  const D xz = entry(p.xz, mean.x, mean.z);
  const D yy = entry(p.yy, mean.y, mean.y);
  const D yz = entry(p.yz, mean.y, mean.z);
  const D zz = entry(p.zz, mean.z, mean.z);
  return {{{xx, xy, xz}, {xy, yy, yz}, {xz, yz, zz}}};
}

/// Of kEigenBlock points from the i-th, their normals from `normal`.
HWY_INLINE void SpreadAt(const TangentSums& sums, std::size_t i, const Vector& n, float* larger,
                         float* smaller, const VectorPlanes& direction) {
  const Doubles d;
  const D zero = hn::Zero(d);
  const D by_two = hn::Set(d, 0.5);
  const Covariance covariance = CovarianceOf(sums, i);
  const Vector v = Across(n);
  const Vector u = Cross(v, n);
  const Vector cu = covariance.Times(u);
  const D uu = Dot(u, cu);
  const D uv = Dot(v, cu);
  const D vv = Dot(v, covariance.Times(v));
  const D middle = hn::Mul(by_two, hn::Add(uu, vv));
  const D half = hn::Mul(by_two, hn::Sub(uu, vv));
  const D spread = hn::Sqrt(hn::Add(hn::Mul(half, half), hn::Mul(uv, uv)));
  // Eigenvector of the larger eigenvalue, from the row that does not cancel.
  const auto first = hn::Ge(half, zero);
  const Vector along = Plus(Scaled(u, hn::IfThenElse(first, hn::Add(half, spread), uv)),
                            Scaled(v, hn::IfThenElse(first, uv, hn::Sub(spread, half))));
  const D length = hn::Sqrt(Dot(along, along));
  const auto round = hn::Le(length, zero);
  const D inverse = Inverse(length);
  const auto store = [&](D own, D other, float* to) {
    Store(hn::IfThenElse(round, other, hn::Mul(own, inverse)), to + i);
  };
  const auto seen = hn::Gt(Dot(n, n), zero);
  Store(hn::IfThenElseZero(seen, hn::Add(middle, spread)), larger + i);
  Store(hn::IfThenElseZero(seen, hn::Max(zero, hn::Sub(middle, spread))), smaller + i);
  store(along.x, u.x, direction.x);
  store(along.y, u.y, direction.y);
  store(along.z, u.z, direction.z);
}

void TangentSpread(const TangentSums& sums, std::size_t count, float* larger, float* smaller,
                   const VectorPlanes& direction) {
  const std::size_t lanes = hn::Lanes(Doubles());
  for (std::size_t i = 0; i < count; i += lanes) {
    const auto normal = [&](std::size_t axis) {
      if (i + lanes <= count) return Load(sums.normal[axis] + i);
      float last[kEigenBlock] = {};
      std::copy(sums.normal[axis] + i, sums.normal[axis] + count, last);
      return Load(last);
    };
    SpreadAt(sums, i, {normal(0), normal(1), normal(2)}, larger, smaller, direction);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace kernels
}  // namespace grapnel
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace grapnel::kernels {

HWY_EXPORT(TangentSpread);

void tangent_spread(const TangentSums& sums, std::size_t count, float* larger, float* smaller,
                    const VectorPlanes& direction) noexcept {
  HWY_DYNAMIC_DISPATCH(TangentSpread)(sums, count, larger, smaller, direction);
}

}  // namespace grapnel::kernels
#endif
