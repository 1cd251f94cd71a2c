#include "pipeline/kernels/eigenvectors.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pipeline/kernels/eigenvectors.cpp"
#include "hwy/foreach_target.h"
#include "hwy/highway.h"

HWY_BEFORE_NAMESPACE();
namespace grapnel {
namespace kernels {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Lanes = hn::CappedTag<float, kVectorBlock>;
using V = hn::Vec<Lanes>;

HWY_INLINE V Load(const float* from) { return hn::LoadU(Lanes(), from); }
HWY_INLINE V Number(float value) { return hn::Set(Lanes(), value); }

struct Axis {
  V x, y, z;
};
HWY_INLINE Axis Cross(const Axis& a, const Axis& b) {
  return {hn::Sub(hn::Mul(a.y, b.z), hn::Mul(a.z, b.y)),
          hn::Sub(hn::Mul(a.z, b.x), hn::Mul(a.x, b.z)),
          hn::Sub(hn::Mul(a.x, b.y), hn::Mul(a.y, b.x))};
}
HWY_INLINE V Squared(const Axis& a) {
  return hn::Add(hn::Add(hn::Mul(a.x, a.x), hn::Mul(a.y, a.y)), hn::Mul(a.z, a.z));
}

/// A matrix divided by its trace, less a third of the unit matrix, and its eigenvalues.
struct Deviator {
  V trace, xx, xy, xz, yy, yz, zz, smallest, middle, largest;
};

/// cos(acos(r) / 3) - 1/2 for e = 1 + r; see trisected_cosine in symmetric3.cpp. Three of Newton's
/// steps reach the last bit of a float.
HWY_INLINE V Trisected(V e) {
  V g = hn::Mul(hn::Sqrt(hn::Mul(e, Number(1.0F / 6.0F))),
                hn::Sub(Number(1.0F), hn::Mul(Number(0.067F), e)));
  for (int i = 0; i < 3; ++i) {
    const V square = hn::Mul(g, g);
    const V cubic = hn::Mul(hn::Mul(Number(4.0F), square), g);
    const V value = hn::Sub(hn::Add(hn::Mul(Number(6.0F), square), cubic), e);
    const V slope = hn::Mul(Number(12.0F), hn::Add(g, square));
    g = hn::Sub(g, hn::Div(value, hn::Max(slope, Number(1e-30F))));
  }
  return g;
}

HWY_INLINE Deviator Take(const SymmetricPlanes& m, std::size_t i) {
  const V third = Number(1.0F / 3.0F);
  const V one = Number(1.0F);
  Deviator a;
  a.trace = hn::Add(hn::Add(Load(m.xx + i), Load(m.yy + i)), Load(m.zz + i));
  // Squares of what is smaller leave single precision.
  const V scale = hn::Div(one, hn::Max(a.trace, Number(1e-30F)));
  a.xx = hn::Sub(hn::Mul(Load(m.xx + i), scale), third);
  a.yy = hn::Sub(hn::Mul(Load(m.yy + i), scale), third);
  a.zz = hn::Sub(hn::Mul(Load(m.zz + i), scale), third);
  a.xy = hn::Mul(Load(m.xy + i), scale);
  a.xz = hn::Mul(Load(m.xz + i), scale);
  a.yz = hn::Mul(Load(m.yz + i), scale);
  const V on = Squared({a.xx, a.yy, a.zz});
  const V off = Squared({a.xy, a.xz, a.yz});
  const V p = hn::Sqrt(hn::Mul(hn::Add(on, hn::Add(off, off)), Number(1.0F / 6.0F)));
  const V first = hn::Mul(a.xx, hn::Sub(hn::Mul(a.yy, a.zz), hn::Mul(a.yz, a.yz)));
  const V second = hn::Mul(a.xy, hn::Sub(hn::Mul(a.xy, a.zz), hn::Mul(a.yz, a.xz)));
  const V last = hn::Mul(a.xz, hn::Sub(hn::Mul(a.xy, a.yz), hn::Mul(a.yy, a.xz)));
  const V determinant = hn::Add(hn::Sub(first, second), last);
  const V cube = hn::Mul(hn::Mul(hn::Add(p, p), p), p);
  const V r = hn::Div(determinant, hn::Max(cube, Number(1e-30F)));
  const V e = hn::Add(one, hn::Min(hn::Max(r, Number(-1.0F)), one));
  const V c = hn::Add(Number(0.5F), Trisected(e));
  const V s = hn::Sqrt(hn::Max(hn::Zero(Lanes()), hn::Sub(one, hn::Mul(c, c))));
  a.largest = hn::Mul(hn::Add(p, p), c);
  a.smallest = hn::Neg(hn::Mul(p, hn::Add(c, hn::Mul(Number(1.7320508F), s))));
  a.middle = hn::Min(hn::Max(hn::Neg(hn::Add(a.largest, a.smallest)), a.smallest), a.largest);
  return a;
}

/// Unit vector across the rows of the matrix less an eigenvalue, the longest of three products;
/// zero unless `apart`.
template <class Mask>
HWY_INLINE void StoreAcross(const Deviator& m, V value, Mask apart, std::size_t i,
                            const VectorPlanes& out) {
  const Axis a = {hn::Sub(m.xx, value), m.xy, m.xz};
  const Axis b = {m.xy, hn::Sub(m.yy, value), m.yz};
  const Axis c = {m.xz, m.yz, hn::Sub(m.zz, value)};
  Axis best = Cross(a, b);
  V squared = Squared(best);
  for (const Axis& other : {Cross(a, c), Cross(b, c)}) {
    const V other_squared = Squared(other);
    const auto longer = hn::Gt(other_squared, squared);
    best.x = hn::IfThenElse(longer, other.x, best.x);
    best.y = hn::IfThenElse(longer, other.y, best.y);
    best.z = hn::IfThenElse(longer, other.z, best.z);
    squared = hn::Max(squared, other_squared);
  }
  const V length = hn::Sqrt(squared);
  const auto sound = hn::And(apart, hn::Gt(length, Number(0.0F)));
  const V by = hn::IfThenElseZero(sound, hn::Div(Number(1.0F), length));
  hn::StoreU(hn::Mul(best.x, by), Lanes(), out.x + i);
  hn::StoreU(hn::Mul(best.y, by), Lanes(), out.y + i);
  hn::StoreU(hn::Mul(best.z, by), Lanes(), out.z + i);
}

HWY_INLINE hn::Mask<Lanes> Apart(const Deviator& m, V gap) {
  const V largest = hn::Add(m.largest, Number(1.0F / 3.0F));
  return hn::And(hn::Gt(gap, hn::Mul(Number(kLeastGap), largest)), hn::Gt(m.trace, Number(1e-30F)));
}

void SmallestEigenvectors(const SymmetricPlanes& matrices, std::size_t count,
                          const VectorPlanes& out) {
  for (std::size_t i = 0; i < count; i += hn::Lanes(Lanes())) {
    const Deviator m = Take(matrices, i);
    StoreAcross(m, m.smallest, Apart(m, hn::Sub(m.middle, m.smallest)), i, out);
  }
}

void LargestEigenvectors(const SymmetricPlanes& matrices, std::size_t count, float* root,
                         const VectorPlanes& out) {
  const V zero = hn::Zero(Lanes());
  for (std::size_t i = 0; i < count; i += hn::Lanes(Lanes())) {
    const Deviator m = Take(matrices, i);
    const V value = hn::Mul(hn::Add(m.largest, Number(1.0F / 3.0F)), hn::Max(m.trace, zero));
    hn::StoreU(hn::Sqrt(hn::Max(value, zero)), Lanes(), root + i);
    StoreAcross(m, m.largest, Apart(m, hn::Sub(m.largest, m.middle)), i, out);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace kernels
}  // namespace grapnel
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace grapnel::kernels {

HWY_EXPORT(SmallestEigenvectors);
HWY_EXPORT(LargestEigenvectors);

void smallest_eigenvectors(const SymmetricPlanes& matrices, std::size_t count,
                           const VectorPlanes& out) noexcept {
  HWY_DYNAMIC_DISPATCH(SmallestEigenvectors)(matrices, count, out);
}
void largest_eigenvectors(const SymmetricPlanes& matrices, std::size_t count, float* root,
                          const VectorPlanes& out) noexcept {
  HWY_DYNAMIC_DISPATCH(LargestEigenvectors)(matrices, count, root, out);
}

}  // namespace grapnel::kernels
#endif
