// Included once per SIMD target.
#if defined(GRAPNEL_KERNELS_PAIR_BINS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef GRAPNEL_KERNELS_PAIR_BINS_INL_H_
#undef GRAPNEL_KERNELS_PAIR_BINS_INL_H_
#else
#define GRAPNEL_KERNELS_PAIR_BINS_INL_H_
#endif

#include "hwy/highway.h"
#include "pipeline/kernels/pair_features.h"

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

/// Bin of value in low … low + 1/scale: floor(bins (value - low) scale), clamped.
template <class D, class V = hn::Vec<D>>
HWY_INLINE hn::Vec<hn::RebindToSigned<D>> Bin(D d, V value, float low, float scale, float bins) {
  const hn::RebindToSigned<D> di;
  const V place = hn::Mul(hn::Sub(value, hn::Set(d, low)), hn::Set(d, scale));
  const V clamped = hn::Min(hn::Max(place, hn::Zero(d)), hn::Set(d, bins - 0.5F));
  return hn::ConvertTo(di, clamped);
}

template <class D>
struct PairOfBins {
  hn::Vec<hn::RebindToSigned<D>> f1, f2, f3;
  hn::Mask<hn::RebindToSigned<D>> none;
};

/// Bins of the features of the pairs (p, q). With unit normals w·n = (d·n - (d·u)(u·n)) / |d × u|,
/// so that neither v nor w need be formed.
template <class D, class V = hn::Vec<D>>
HWY_INLINE PairOfBins<D> BinsOfPairs(D d, const Vector3<V>& p, const Vector3<V>& np,
                                     const Vector3<V>& q, const Vector3<V>& nq, float bins) {
  const hn::RebindToSigned<D> di;
  const V zero = hn::Zero(d);
  const V one = hn::Set(d, 1.0F);
  const Vector3<V> line{hn::Sub(q.x, p.x), hn::Sub(q.y, p.y), hn::Sub(q.z, p.z)};
  const V length = hn::Sqrt(Dot(line, line));
  const V along_p = Dot(np, line);
  const V along_q = Dot(nq, line);
  const V cos_normals = Dot(np, nq);
  // The source of the pair is the end whose normal makes the smaller angle with the line.
  const auto from_q = hn::Lt(hn::Abs(along_p), hn::Abs(along_q));
  const Vector3<V> u = Choose(from_q, nq, np);
  const Vector3<V> target = Choose(from_q, np, nq);
  const V along_u = hn::IfThenElse(from_q, hn::Neg(along_q), along_p);
  const V along_target = hn::IfThenElse(from_q, hn::Neg(along_p), along_q);
  const Vector3<V> across = Cross(line, u);
  const V width = hn::Sqrt(Dot(across, across));
  const V volume = Dot(across, target);
  const V area = hn::Mul(length, width);
  const auto none = hn::Eq(area, zero);
  const V inverse = hn::Div(one, hn::IfThenElse(none, one, area));
  const V f1 =
      Atan2(d, hn::Sub(along_target, hn::Mul(along_u, cos_normals)), hn::Mul(cos_normals, width));
  const V f2 = hn::Mul(hn::IfThenElse(from_q, hn::Neg(volume), volume), hn::Mul(inverse, length));
  const V f3 = hn::Mul(along_u, hn::Mul(inverse, width));
  return {Bin(d, f1, -3.14159265F, bins * 0.159154943F, bins), Bin(d, f2, -1.0F, bins * 0.5F, bins),
          Bin(d, f3, -1.0F, bins * 0.5F, bins), hn::RebindMask(di, none)};
}

/// The three bins in one number; dropped pairs give kNoPair.
template <class D>
HWY_INLINE hn::Vec<hn::RebindToSigned<D>> Packed(D, const PairOfBins<D>& b) {
  const hn::RebindToSigned<D> di;
  const auto packed = hn::Add(b.f1, hn::Add(hn::ShiftLeft<8>(b.f2), hn::ShiftLeft<16>(b.f3)));
  return hn::IfThenElse(b.none, hn::Set(di, kNoPair), packed);
}

template <class V>
struct OrientedPoints {
  Vector3<V> place, normal;
};

#if HWY_TARGET != HWY_SCALAR
/// Columns 0…3 of four rows of each 128-bit block.
template <class D, class V = hn::Vec<D>>
HWY_INLINE void TransposeBlocks(D d, const V (&rows)[4], V (&columns)[4]) {
  const hn::Repartition<double, D> dd;
  const auto pair = [&](V v) { return hn::BitCast(dd, v); };
  const auto low01 = pair(hn::InterleaveLower(d, rows[0], rows[1]));
  const auto high01 = pair(hn::InterleaveUpper(d, rows[0], rows[1]));
  const auto low23 = pair(hn::InterleaveLower(d, rows[2], rows[3]));
  const auto high23 = pair(hn::InterleaveUpper(d, rows[2], rows[3]));
  columns[0] = hn::BitCast(d, hn::InterleaveLower(dd, low01, low23));
  columns[1] = hn::BitCast(d, hn::InterleaveUpper(dd, low01, low23));
  columns[2] = hn::BitCast(d, hn::InterleaveLower(dd, high01, high23));
  columns[3] = hn::BitCast(d, hn::InterleaveUpper(dd, high01, high23));
}

#endif

/// The points at `index`, one a lane.
template <class D, class V = hn::Vec<D>>
HWY_INLINE OrientedPoints<V> LoadPoints(D d, const float* points, const std::int32_t* index) {
  const auto row = [&](std::size_t k) {
    return points + static_cast<std::size_t>(index[k]) * kOrientedRow;
  };
#if HWY_TARGET == HWY_SCALAR
  const auto at = [&](std::size_t i) { return hn::Set(d, row(0)[i]); };
  return {{at(0), at(1), at(2)}, {at(3), at(4), at(5)}};
#else
  if constexpr (hn::MaxLanes(d) == 8) {
    V low[4];
    V high[4];
    const V first[4] = {hn::LoadU(d, row(0)), hn::LoadU(d, row(1)), hn::LoadU(d, row(2)),
                        hn::LoadU(d, row(3))};
    const V second[4] = {hn::LoadU(d, row(4)), hn::LoadU(d, row(5)), hn::LoadU(d, row(6)),
                         hn::LoadU(d, row(7))};
    TransposeBlocks(d, first, low);
    TransposeBlocks(d, second, high);
    const auto lower = [&](int i) { return hn::ConcatLowerLower(d, high[i], low[i]); };
    const auto upper = [&](int i) { return hn::ConcatUpperUpper(d, high[i], low[i]); };
    return {{lower(0), lower(1), lower(2)}, {lower(3), upper(0), upper(1)}};
  } else {
    static_assert(hn::MaxLanes(d) == 4);
    V front[4];
    V back[4];
    const V first[4] = {hn::LoadU(d, row(0)), hn::LoadU(d, row(1)), hn::LoadU(d, row(2)),
                        hn::LoadU(d, row(3))};
    const V second[4] = {hn::LoadU(d, row(0) + 4), hn::LoadU(d, row(1) + 4),
                         hn::LoadU(d, row(2) + 4), hn::LoadU(d, row(3) + 4)};
    TransposeBlocks(d, first, front);
    TransposeBlocks(d, second, back);
    return {{front[0], front[1], front[2]}, {front[3], back[0], back[1]}};
  }
#endif
}

}  // namespace HWY_NAMESPACE
}  // namespace kernels
}  // namespace grapnel
HWY_AFTER_NAMESPACE();

#endif  // GRAPNEL_KERNELS_PAIR_BINS_INL_H_
