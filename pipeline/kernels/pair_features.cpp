#include "pipeline/kernels/pair_features.h"

#include <algorithm>
#include <array>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pipeline/kernels/pair_features.cpp"
#include "hwy/foreach_target.h"
#include "hwy/highway.h"

HWY_BEFORE_NAMESPACE();
namespace grapnel {
namespace kernels {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

template <class V>
struct Vector3 {
  V x, y, z;
};

template <class V>
HWY_INLINE V Dot(const Vector3<V>& a, const Vector3<V>& b) {
  return hn::Add(hn::Add(hn::Mul(a.x, b.x), hn::Mul(a.y, b.y)), hn::Mul(a.z, b.z));
}
template <class V>
HWY_INLINE Vector3<V> Cross(const Vector3<V>& a, const Vector3<V>& b) {
  return {hn::Sub(hn::Mul(a.y, b.z), hn::Mul(a.z, b.y)),
          hn::Sub(hn::Mul(a.z, b.x), hn::Mul(a.x, b.z)),
          hn::Sub(hn::Mul(a.x, b.y), hn::Mul(a.y, b.x))};
}
template <class M, class V>
HWY_INLINE Vector3<V> Choose(M mask, const Vector3<V>& yes, const Vector3<V>& no) {
  return {hn::IfThenElse(mask, yes.x, no.x), hn::IfThenElse(mask, yes.y, no.y),
          hn::IfThenElse(mask, yes.z, no.z)};
}

/// Odd polynomial of degree 11 for the arc tangent on 0…1, error below 2e-6 (Hastings 1955).
template <class D, class V = hn::Vec<D>>
HWY_INLINE V Atan2(D d, V y, V x) {
  const V ax = hn::Abs(x);
  const V ay = hn::Abs(y);
  const V larger = hn::Max(ax, ay);
  const V zero = hn::Zero(d);
  const V divisor = hn::IfThenElse(hn::Eq(larger, zero), hn::Set(d, 1.0F), larger);
  const V t = hn::Div(hn::Min(ax, ay), divisor);
  const V s = hn::Mul(t, t);
  V p = hn::Set(d, -0.01172120F);
  p = hn::Add(hn::Mul(p, s), hn::Set(d, 0.05265332F));
  p = hn::Add(hn::Mul(p, s), hn::Set(d, -0.11643287F));
  p = hn::Add(hn::Mul(p, s), hn::Set(d, 0.19354346F));
  p = hn::Add(hn::Mul(p, s), hn::Set(d, -0.33262347F));
  p = hn::Add(hn::Mul(p, s), hn::Set(d, 0.99997726F));
  V angle = hn::Mul(p, t);
  angle = hn::IfThenElse(hn::Gt(ay, ax), hn::Sub(hn::Set(d, 1.57079633F), angle), angle);
  angle = hn::IfThenElse(hn::Lt(x, zero), hn::Sub(hn::Set(d, 3.14159265F), angle), angle);
  return hn::IfThenElse(hn::Lt(y, zero), hn::Neg(angle), angle);
}

/// Bin of value in low … low + 1/scale: floor(11 (value - low) scale), clamped.
template <class D, class V = hn::Vec<D>>
HWY_INLINE hn::Vec<hn::RebindToSigned<D>> Bin(D d, V value, float low, float scale) {
  const hn::RebindToSigned<D> di;
  const V place = hn::Mul(hn::Sub(value, hn::Set(d, low)), hn::Set(d, scale));
  const V clamped = hn::Min(hn::Max(place, hn::Zero(d)), hn::Set(d, kPairBins - 0.5F));
  return hn::ConvertTo(di, clamped);
}

/// Features of the pairs (p, q), packed into bins; dropped pairs give kNoPair.
template <class D, class V = hn::Vec<D>>
HWY_INLINE hn::Vec<hn::RebindToSigned<D>> PairBins(D d, const Vector3<V>& p, const Vector3<V>& np,
                                                   const Vector3<V>& q, const Vector3<V>& nq) {
  const hn::RebindToSigned<D> di;
  const V zero = hn::Zero(d);
  const V one = hn::Set(d, 1.0F);
  const Vector3<V> line{hn::Sub(q.x, p.x), hn::Sub(q.y, p.y), hn::Sub(q.z, p.z)};
  const V length = hn::Sqrt(Dot(line, line));
  const auto coincident = hn::Eq(length, zero);
  const V inverse = hn::Div(one, hn::IfThenElse(coincident, one, length));
  const V cos_p = hn::Mul(Dot(np, line), inverse);
  const V cos_q = hn::Mul(Dot(nq, line), inverse);
  // The source of the pair is the end whose normal makes the smaller angle with the line.
  const auto from_q = hn::Lt(hn::Abs(cos_p), hn::Abs(cos_q));
  const Vector3<V> u = Choose(from_q, nq, np);
  const Vector3<V> target = Choose(from_q, np, nq);
  const Vector3<V> back{hn::Neg(line.x), hn::Neg(line.y), hn::Neg(line.z)};
  const V f3 = hn::IfThenElse(from_q, hn::Neg(cos_q), cos_p);
  Vector3<V> v = Cross(Choose(from_q, back, line), u);
  const V v_length = hn::Sqrt(Dot(v, v));
  const auto parallel = hn::Eq(v_length, zero);
  const V v_inverse = hn::Div(one, hn::IfThenElse(parallel, one, v_length));
  v = {hn::Mul(v.x, v_inverse), hn::Mul(v.y, v_inverse), hn::Mul(v.z, v_inverse)};
  const Vector3<V> w = Cross(u, v);
  const V f1 = Atan2(d, Dot(w, target), Dot(u, target));
  const V f2 = Dot(v, target);

  constexpr float kBins = kPairBins;
  const auto bin1 = Bin(d, f1, -3.14159265F, kBins * 0.159154943F);
  const auto bin2 = Bin(d, f2, -1.0F, kBins * 0.5F);
  const auto bin3 = Bin(d, f3, -1.0F, kBins * 0.5F);
  const auto packed = hn::Or(bin1, hn::Or(hn::ShiftLeft<8>(bin2), hn::ShiftLeft<16>(bin3)));
  const auto none = hn::RebindMask(di, hn::Or(coincident, parallel));
  return hn::IfThenElse(none, hn::Set(di, kNoPair), packed);
}

void PairBinsOf(const OrientedPlanes& points, std::int32_t point_i,
                std::span<const std::int32_t> others, std::int32_t* bins) {
  const hn::CappedTag<float, 8> d;
  const hn::RebindToSigned<decltype(d)> di;
  const std::size_t lanes = hn::Lanes(d);
  using V = hn::Vec<decltype(d)>;
  const Vector3<V> p{hn::Set(d, points.x[point_i]), hn::Set(d, points.y[point_i]),
                     hn::Set(d, points.z[point_i])};
  const Vector3<V> np{hn::Set(d, points.nx[point_i]), hn::Set(d, points.ny[point_i]),
                      hn::Set(d, points.nz[point_i])};
  HWY_ALIGN std::array<std::int32_t, 8> last;
  for (std::size_t i = 0; i < others.size(); i += lanes) {
    const std::int32_t* from = others.data() + i;
    if (i + lanes > others.size()) {
      last.fill(point_i);
      std::copy(from, others.data() + others.size(), last.begin());
      from = last.data();
    }
    const auto index = hn::LoadU(di, from);
    const Vector3<V> q{hn::GatherIndex(d, points.x, index), hn::GatherIndex(d, points.y, index),
                       hn::GatherIndex(d, points.z, index)};
    const Vector3<V> nq{hn::GatherIndex(d, points.nx, index), hn::GatherIndex(d, points.ny, index),
                        hn::GatherIndex(d, points.nz, index)};
    hn::StoreU(PairBins(d, p, np, q, nq), di, bins + i);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace kernels
}  // namespace grapnel
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace grapnel::kernels {

HWY_EXPORT(PairBinsOf);

void pair_bins(const OrientedPlanes& points, std::int32_t point_i,
               std::span<const std::int32_t> others, std::int32_t* bins) noexcept {
  HWY_DYNAMIC_DISPATCH(PairBinsOf)(points, point_i, others, bins);
}

}  // namespace grapnel::kernels
#endif
