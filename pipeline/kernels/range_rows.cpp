#include "pipeline/kernels/range_rows.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pipeline/kernels/range_rows.cpp"
#include "hwy/foreach_target.h"
#include "hwy/highway.h"

HWY_BEFORE_NAMESPACE();
namespace grapnel {
namespace kernels {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Lanes = hn::CappedTag<float, kRangeBlock>;
using V = hn::Vec<Lanes>;

HWY_INLINE V Load(const float* from) { return hn::LoadU(Lanes(), from); }
HWY_INLINE V Squared(V x, V y, V z) {
  return hn::Add(hn::Add(hn::Mul(x, x), hn::Mul(y, y)), hn::Mul(z, z));
}

struct Place {
  V x, y, z;
};
HWY_INLINE Place PlaceAt(const RangePlanes& p, std::ptrdiff_t at) {
  return {Load(p.x + at), Load(p.y + at), Load(p.z + at)};
}
HWY_INLINE Place Less(const Place& a, const Place& b) {
  return {hn::Sub(a.x, b.x), hn::Sub(a.y, b.y), hn::Sub(a.z, b.z)};
}

/// Sums of what is counted; the rest is zero already.
struct Sums {
  V count, x, y, z, xx, xy, xz, yy, yz, zz;
};
HWY_INLINE Sums NoSums() {
  const V zero = hn::Zero(Lanes());
  return {zero, zero, zero, zero, zero, zero, zero, zero, zero, zero};
}

template <class Mask>
HWY_INLINE void AddWhere(Mask counted, const Place& p, Sums& s) {
  const V x = hn::IfThenElseZero(counted, p.x);
  const V y = hn::IfThenElseZero(counted, p.y);
  const V z = hn::IfThenElseZero(counted, p.z);
  s.count = hn::Add(s.count, hn::IfThenElseZero(counted, hn::Set(Lanes(), 1.0F)));
  s.x = hn::Add(s.x, x);
  s.y = hn::Add(s.y, y);
  s.z = hn::Add(s.z, z);
  s.xx = hn::Add(s.xx, hn::Mul(x, x));
  s.xy = hn::Add(s.xy, hn::Mul(x, y));
  s.xz = hn::Add(s.xz, hn::Mul(x, z));
  s.yy = hn::Add(s.yy, hn::Mul(y, y));
  s.yz = hn::Add(s.yz, hn::Mul(y, z));
  s.zz = hn::Add(s.zz, hn::Mul(z, z));
}

HWY_INLINE void StoreEntry(V products, V by, V a, V b, float* to) {
  hn::StoreU(hn::Sub(hn::Mul(products, by), hn::Mul(a, b)), Lanes(), to);
}
HWY_INLINE void StoreSpread(const Sums& s, std::ptrdiff_t lane, const Spread& out) {
  const Lanes d;
  const V one = hn::Set(d, 1.0F);
  const V by = hn::Div(one, hn::Max(s.count, one));
  const V x = hn::Mul(s.x, by);
  const V y = hn::Mul(s.y, by);
  const V z = hn::Mul(s.z, by);
  StoreEntry(s.xx, by, x, x, out.xx + lane);
  StoreEntry(s.xy, by, x, y, out.xy + lane);
  StoreEntry(s.xz, by, x, z, out.xz + lane);
  StoreEntry(s.yy, by, y, y, out.yy + lane);
  StoreEntry(s.yz, by, y, z, out.yz + lane);
  StoreEntry(s.zz, by, z, z, out.zz + lane);
  hn::StoreU(x, d, out.mean_x + lane);
  hn::StoreU(y, d, out.mean_y + lane);
  hn::StoreU(z, d, out.mean_z + lane);
}

/// The pixel itself is the nearest of the nine.
constexpr int kOthers = 8;
constexpr int kAround = 24;

HWY_INLINE void Order(V& a, V& b) {
  const V less = hn::Min(a, b);
  b = hn::Max(a, b);
  a = less;
}

/// Ascending, by the 19 exchanges of the smallest network for eight.
HWY_INLINE void Sort(V* v) {
  constexpr int kFirst[][2] = {{0, 1}, {2, 3}, {4, 5}, {6, 7}, {0, 2}, {1, 3}, {4, 6}, {5, 7}};
  constexpr int kSecond[][2] = {{1, 2}, {5, 6}, {0, 4}, {3, 7}, {1, 5}, {2, 6}};
  constexpr int kLast[][2] = {{1, 4}, {3, 6}, {2, 4}, {3, 5}, {3, 4}};
  // Short enough each to be unrolled.
  for (const auto& pair : kFirst) Order(v[pair[0]], v[pair[1]]);
  for (const auto& pair : kSecond) Order(v[pair[0]], v[pair[1]]);
  for (const auto& pair : kLast) Order(v[pair[0]], v[pair[1]]);
}

/// Eighth smallest of 24 values, which are lost: eights are sorted, and the smaller halves merged.
HWY_INLINE V EighthOf(V* v) {
  Sort(v);
  Sort(v + kOthers);
  for (int i = 0; i < kOthers; ++i) v[i] = hn::Min(v[i], v[2 * kOthers - 1 - i]);
  // Rising, then falling: half a network orders it.
  for (int i = 0; i < 4; ++i) Order(v[i], v[i + 4]);
  for (int i = 0; i < 2; ++i) Order(v[i], v[i + 2]);
  for (int i = 4; i < 6; ++i) Order(v[i], v[i + 2]);
  for (int i = 0; i < kOthers; i += 2) Order(v[i], v[i + 1]);
  Sort(v + 2 * kOthers);
  V eighth = hn::Min(v[0], v[kAround - 1]);
  for (int i = 1; i < kOthers; ++i) eighth = hn::Max(eighth, hn::Min(v[i], v[kAround - 1 - i]));
  return eighth;
}

void FitPatches(const RangePlanes& image, std::ptrdiff_t at, float* ninth_m2, const Spread& out) {
  const Lanes d;
  std::ptrdiff_t around[kAround];
  int count = 0;
  for (std::ptrdiff_t dv = -2; dv <= 2; ++dv) {
    for (std::ptrdiff_t du = -2; du <= 2; ++du) {
      if (du != 0 || dv != 0) around[count++] = dv * image.stride + du;
    }
  }
  for (std::ptrdiff_t lane = 0; lane < kRangeBlock;
       lane += static_cast<std::ptrdiff_t>(hn::Lanes(d))) {
    const std::ptrdiff_t here = at + lane;
    const Place own = PlaceAt(image, here);
    V squared[kAround];
    V ordered[kAround];
    for (int i = 0; i < kAround; ++i) {
      const Place p = Less(PlaceAt(image, here + around[i]), own);
      squared[i] = Squared(p.x, p.y, p.z);
      ordered[i] = squared[i];
    }
    const V ninth = hn::Min(EighthOf(ordered), hn::Set(d, 4e30F));
    const V limit = hn::Mul(hn::Set(d, 4.0F), ninth);
    Sums sums = NoSums();
    sums.count = hn::Set(d, 1.0F);
    for (int i = 0; i < kAround; ++i) {
      const Place p = Less(PlaceAt(image, here + around[i]), own);
      AddWhere(hn::Le(squared[i], limit), p, sums);
    }
    hn::StoreU(ninth, d, ninth_m2 + lane);
    StoreSpread(sums, lane, out);
  }
}

void Jumps(const RangePlanes& image, const JumpPlanes& planes, std::ptrdiff_t at,
           std::ptrdiff_t step, float* out) {
  const Lanes d;
  const V zero = hn::Zero(d);
  const V one = hn::Set(d, 1.0F);
  for (std::ptrdiff_t lane = 0; lane < kRangeBlock;
       lane += static_cast<std::ptrdiff_t>(hn::Lanes(d))) {
    const std::ptrdiff_t here = at + lane;
    const Place own = PlaceAt(image, here);
    const V reach = Load(planes.reach_m2 + here);
    V count = zero;
    V range = zero;
    Place sum = {zero, zero, zero};
    for (std::ptrdiff_t i = 1; i <= 3; ++i) {
      const Place p = PlaceAt(image, here + i * step);
      const auto valid = hn::Lt(p.x, hn::Set(d, 1e14F));
      count = hn::Add(count, hn::IfThenElseZero(valid, one));
      range = hn::Add(range, hn::IfThenElseZero(valid, Load(planes.range + here + i * step)));
      sum.x = hn::Add(sum.x, hn::IfThenElseZero(valid, hn::Sub(p.x, own.x)));
      sum.y = hn::Add(sum.y, hn::IfThenElseZero(valid, hn::Sub(p.y, own.y)));
      sum.z = hn::Add(sum.z, hn::IfThenElseZero(valid, hn::Sub(p.z, own.z)));
    }
    const V by = hn::Div(one, hn::Max(count, one));
    const V squared = Squared(hn::Mul(sum.x, by), hn::Mul(sum.y, by), hn::Mul(sum.z, by));
    const V score = hn::Sub(one, hn::Sqrt(hn::Div(reach, hn::Max(squared, hn::Set(d, 1e-30F)))));
    const auto nearer = hn::Lt(hn::Mul(range, by), Load(planes.range + here));
    const V jump =
        hn::IfThenElseZero(hn::Gt(squared, reach), hn::IfThenElse(nearer, hn::Neg(score), score));
    const V seen = hn::IfThenElseZero(hn::Gt(count, zero), jump);
    const auto far = hn::Gt(Load(image.x + here + step), hn::Set(d, 1.5e15F));
    const V value = hn::IfThenElse(far, one, seen);
    hn::StoreU(hn::IfThenElseZero(hn::Ge(reach, zero), value), d, out + lane);
  }
}

std::uint32_t FaceCamera(const RangePlanes& image, std::ptrdiff_t at, const VectorPlanes& normals,
                         float* reach_m2) {
  const Lanes d;
  const V zero = hn::Zero(d);
  std::uint32_t missing = 0;
  for (std::ptrdiff_t lane = 0; lane < kRangeBlock;
       lane += static_cast<std::ptrdiff_t>(hn::Lanes(d))) {
    const Place own = PlaceAt(image, at + lane);
    const V x = Load(normals.x + lane);
    const V y = Load(normals.y + lane);
    const V z = Load(normals.z + lane);
    const V along = hn::Add(hn::Add(hn::Mul(x, own.x), hn::Mul(y, own.y)), hn::Mul(z, own.z));
    const auto away = hn::Gt(along, zero);
    hn::StoreU(hn::IfThenElse(away, hn::Neg(x), x), d, normals.x + lane);
    hn::StoreU(hn::IfThenElse(away, hn::Neg(y), y), d, normals.y + lane);
    hn::StoreU(hn::IfThenElse(away, hn::Neg(z), z), d, normals.z + lane);
    const V reach = Load(reach_m2 + lane);
    const auto valid = hn::Lt(own.x, hn::Set(d, 1e14F));
    hn::StoreU(hn::IfThenElse(valid, reach, hn::Set(d, -1.0F)), d, reach_m2 + lane);
    const auto flat = hn::Eq(Squared(x, y, z), zero);
    const auto slow = hn::And(valid, hn::Or(flat, hn::Ge(reach, hn::Set(d, kTooFew_m2))));
    std::uint8_t bits[8] = {};
    hn::StoreMaskBits(d, slow, bits);
    missing |= static_cast<std::uint32_t>(bits[0] | bits[1] << 8) << lane;
  }
  return missing;
}

void SmoothScores(const float* scores, std::ptrdiff_t at, std::ptrdiff_t stride, float least,
                  float* out) {
  const Lanes d;
  const V zero = hn::Zero(d);
  const V half = hn::Set(d, 0.5F);
  const V one = hn::Set(d, 1.0F);
  const V limit = hn::Set(d, least);
  for (std::ptrdiff_t lane = 0; lane < kRangeBlock;
       lane += static_cast<std::ptrdiff_t>(hn::Lanes(d))) {
    const float* const here = scores + at + lane;
    const V own = Load(here);
    const auto in_sight = hn::Ge(hn::Add(own, hn::Mul(half, hn::Sub(one, own))), limit);
    if (hn::AllFalse(d, in_sight)) {
      hn::StoreU(own, d, out + lane);
      continue;
    }
    const V above =
        hn::Add(hn::Add(Load(here - stride - 1), Load(here - stride)), Load(here - stride + 1));
    const V below =
        hn::Add(hn::Add(Load(here + stride - 1), Load(here + stride)), Load(here + stride + 1));
    const V beside = hn::Add(Load(here - 1), Load(here + 1));
    const V mean = hn::Mul(hn::Add(hn::Add(above, below), beside), hn::Set(d, 0.125F));
    const auto moved = hn::And(in_sight, hn::Ge(hn::Mul(mean, own), zero));
    const V pull = hn::Mul(hn::Mul(half, mean), hn::Sub(one, hn::Abs(own)));
    hn::StoreU(hn::Add(own, hn::IfThenElseZero(moved, pull)), d, out + lane);
  }
}

void BeamSpread(const RangePlanes& normals, const float* code, std::ptrdiff_t at, float* count,
                const Spread& out) {
  const Lanes d;
  const V half = hn::Set(d, 0.5F);
  for (std::ptrdiff_t lane = 0; lane < kRangeBlock;
       lane += static_cast<std::ptrdiff_t>(hn::Lanes(d))) {
    const std::ptrdiff_t here = at + lane;
    const Place own = PlaceAt(normals, here);
    Sums sums = NoSums();
    for (std::ptrdiff_t dv = -1; dv <= 1; ++dv) {
      for (std::ptrdiff_t du = -1; du <= 1; ++du) {
        if (du == 0 && dv == 0) continue;
        const std::ptrdiff_t first = here + dv * normals.stride + du;
        const std::ptrdiff_t second = first + dv * normals.stride + du;
        const V first_code = Load(code + first);
        const auto open = hn::Gt(first_code, hn::Set(d, -0.5F));
        AddWhere(hn::Gt(first_code, half), Less(PlaceAt(normals, first), own), sums);
        AddWhere(hn::And(open, hn::Gt(Load(code + second), half)),
                 Less(PlaceAt(normals, second), own), sums);
      }
    }
    hn::StoreU(sums.count, d, count + lane);
    StoreSpread(sums, lane, out);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace kernels
}  // namespace grapnel
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace grapnel::kernels {

HWY_EXPORT(FitPatches);
HWY_EXPORT(Jumps);
HWY_EXPORT(BeamSpread);
HWY_EXPORT(FaceCamera);
HWY_EXPORT(SmoothScores);

void fit_patches(const RangePlanes& image, std::ptrdiff_t at, float* ninth_m2,
                 const Spread& out) noexcept {
  HWY_DYNAMIC_DISPATCH(FitPatches)(image, at, ninth_m2, out);
}
void jumps(const RangePlanes& image, const JumpPlanes& planes, std::ptrdiff_t at,
           std::ptrdiff_t step, float* out) noexcept {
  HWY_DYNAMIC_DISPATCH(Jumps)(image, planes, at, step, out);
}
std::uint32_t face_camera(const RangePlanes& image, std::ptrdiff_t at, const VectorPlanes& normals,
                          float* reach_m2) noexcept {
  return HWY_DYNAMIC_DISPATCH(FaceCamera)(image, at, normals, reach_m2);
}
void smooth_scores(const float* scores, std::ptrdiff_t at, std::ptrdiff_t stride, float least,
                   float* out) noexcept {
  HWY_DYNAMIC_DISPATCH(SmoothScores)(scores, at, stride, least, out);
}
void beam_spread(const RangePlanes& normals, const float* code, std::ptrdiff_t at, float* count,
                 const Spread& out) noexcept {
  HWY_DYNAMIC_DISPATCH(BeamSpread)(normals, code, at, count, out);
}

}  // namespace grapnel::kernels
#endif
