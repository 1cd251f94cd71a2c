#include "pipeline/kernels/eigenvalues.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pipeline/kernels/eigenvalues.cpp"
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
HWY_INLINE D Product(D a, D b) { return hn::Mul(a, b); }

/// cos(acos(r) / 3) - 1/2 for e = 1 + r; see trisected_cosine in symmetric3.cpp.
HWY_INLINE D Trisected(D e) {
  const Doubles d;
  const D tiny = hn::Set(d, 1e-300);
  D g = hn::Mul(hn::Sqrt(hn::Div(e, hn::Set(d, 6.0))),
                hn::Sub(hn::Set(d, 1.0), hn::Mul(hn::Set(d, 0.067), e)));
  for (int i = 0; i < 4; ++i) {
    const D square = hn::Mul(g, g);
    const D value = hn::Sub(
        hn::Add(hn::Mul(hn::Set(d, 6.0), square), hn::Mul(hn::Mul(hn::Set(d, 4.0), square), g)), e);
    const D slope = hn::Mul(hn::Set(d, 12.0), hn::Add(g, square));
    g = hn::Sub(g, hn::Div(value, hn::Max(slope, tiny)));
  }
  return g;
}

void Eigenvalues(const SymmetricPlanes& m, std::size_t count, float* smallest, float* middle,
                 float* largest) {
  const Doubles d;
  const D zero = hn::Zero(d);
  const D one = hn::Set(d, 1.0);
  const D two = hn::Set(d, 2.0);
  for (std::size_t i = 0; i < count; i += hn::Lanes(d)) {
    const D xy = Load(m.xy + i);
    const D xz = Load(m.xz + i);
    const D yz = Load(m.yz + i);
    const D q =
        hn::Div(hn::Add(hn::Add(Load(m.xx + i), Load(m.yy + i)), Load(m.zz + i)), hn::Set(d, 3.0));
    const D xx = hn::Sub(Load(m.xx + i), q);
    const D yy = hn::Sub(Load(m.yy + i), q);
    const D zz = hn::Sub(Load(m.zz + i), q);
    const D on = hn::Add(hn::Add(Product(xx, xx), Product(yy, yy)), Product(zz, zz));
    const D off = hn::Add(hn::Add(Product(xy, xy), Product(xz, xz)), Product(yz, yz));
    const D p = hn::Sqrt(hn::Div(hn::Add(on, hn::Mul(two, off)), hn::Set(d, 6.0)));
    const D first = hn::Mul(xx, hn::Sub(Product(yy, zz), Product(yz, yz)));
    const D second = hn::Mul(xy, hn::Sub(Product(xy, zz), Product(yz, xz)));
    const D third = hn::Mul(xz, hn::Sub(Product(xy, yz), Product(yy, xz)));
    const D determinant = hn::Add(hn::Sub(first, second), third);
    const D cube = hn::Mul(hn::Mul(hn::Mul(two, p), p), p);
    const auto spread = hn::Gt(cube, zero);
    const D r = hn::Min(
        hn::Max(hn::Div(determinant, hn::IfThenElse(spread, cube, one)), hn::Set(d, -1.0)), one);
    const D c = hn::Add(hn::Set(d, 0.5), Trisected(hn::Add(one, r)));
    const D s = hn::Sqrt(hn::Max(zero, hn::Sub(one, hn::Mul(c, c))));
    const D high = hn::Add(q, hn::Mul(hn::Mul(two, p), c));
    const D low = hn::Sub(q, hn::Mul(p, hn::Add(c, hn::Mul(hn::Set(d, 1.7320508075688772), s))));
    const D rest = hn::Sub(hn::Sub(hn::Mul(hn::Set(d, 3.0), q), high), low);
    Store(hn::IfThenElse(spread, low, q), smallest + i);
    Store(hn::IfThenElse(spread, hn::Min(hn::Max(rest, low), high), q), middle + i);
    Store(hn::IfThenElse(spread, high, q), largest + i);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace kernels
}  // namespace grapnel
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace grapnel::kernels {

HWY_EXPORT(Eigenvalues);

void eigenvalues(const SymmetricPlanes& matrices, std::size_t count, float* smallest, float* middle,
                 float* largest) noexcept {
  HWY_DYNAMIC_DISPATCH(Eigenvalues)(matrices, count, smallest, middle, largest);
}

}  // namespace grapnel::kernels
#endif
