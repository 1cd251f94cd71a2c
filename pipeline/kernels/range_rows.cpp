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

HWY_INLINE void StoreEntry(V mean_of_products, V a, V b, float* to) {
  hn::StoreU(hn::Sub(mean_of_products, hn::Mul(a, b)), Lanes(), to);
}
HWY_INLINE void StoreSpread(const Sums& s, std::ptrdiff_t lane, const Spread& out) {
  const Lanes d;
  const V by = hn::Max(s.count, hn::Set(d, 1.0F));
  const V x = hn::Div(s.x, by);
  const V y = hn::Div(s.y, by);
  const V z = hn::Div(s.z, by);
  StoreEntry(hn::Div(s.xx, by), x, x, out.xx + lane);
  StoreEntry(hn::Div(s.xy, by), x, y, out.xy + lane);
  StoreEntry(hn::Div(s.xz, by), x, z, out.xz + lane);
  StoreEntry(hn::Div(s.yy, by), y, y, out.yy + lane);
  StoreEntry(hn::Div(s.yz, by), y, z, out.yz + lane);
  StoreEntry(hn::Div(s.zz, by), z, z, out.zz + lane);
  hn::StoreU(x, d, out.mean_x + lane);
  hn::StoreU(y, d, out.mean_y + lane);
  hn::StoreU(z, d, out.mean_z + lane);
}

void FitPatches(const RangePlanes& image, std::ptrdiff_t at, float* ninth_m2, const Spread& out) {
  const Lanes d;
  // The pixel itself is the nearest of the nine.
  constexpr int kOthers = 8;
  for (std::ptrdiff_t lane = 0; lane < kRangeBlock;
       lane += static_cast<std::ptrdiff_t>(hn::Lanes(d))) {
    const std::ptrdiff_t here = at + lane;
    const Place own = PlaceAt(image, here);
    V nearest[kOthers];
    for (V& value : nearest) value = hn::Set(d, 4e30F);
    for (std::ptrdiff_t dv = -2; dv <= 2; ++dv) {
      for (std::ptrdiff_t du = -2; du <= 2; ++du) {
        if (du == 0 && dv == 0) continue;
        const Place p = Less(PlaceAt(image, here + dv * image.stride + du), own);
        V value = Squared(p.x, p.y, p.z);
        for (V& kept : nearest) {
          const V less = hn::Min(kept, value);
          value = hn::Max(kept, value);
          kept = less;
        }
      }
    }
    const V ninth = nearest[kOthers - 1];
    const V limit = hn::Mul(hn::Set(d, 4.0F), ninth);
    Sums sums = NoSums();
    for (std::ptrdiff_t dv = -2; dv <= 2; ++dv) {
      for (std::ptrdiff_t du = -2; du <= 2; ++du) {
        const Place p = Less(PlaceAt(image, here + dv * image.stride + du), own);
        AddWhere(hn::Le(Squared(p.x, p.y, p.z), limit), p, sums);
      }
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
    const V by = hn::Max(count, one);
    const V squared = Squared(hn::Div(sum.x, by), hn::Div(sum.y, by), hn::Div(sum.z, by));
    const V score = hn::Sub(one, hn::Sqrt(hn::Div(reach, hn::Max(squared, hn::Set(d, 1e-30F)))));
    const auto nearer = hn::Lt(hn::Div(range, by), Load(planes.range + here));
    const V jump =
        hn::IfThenElseZero(hn::Gt(squared, reach), hn::IfThenElse(nearer, hn::Neg(score), score));
    const V seen = hn::IfThenElseZero(hn::Gt(count, zero), jump);
    const auto far = hn::Gt(Load(image.x + here + step), hn::Set(d, 1.5e15F));
    const V value = hn::IfThenElse(far, one, seen);
    hn::StoreU(hn::IfThenElseZero(hn::Ge(reach, zero), value), d, out + lane);
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

void fit_patches(const RangePlanes& image, std::ptrdiff_t at, float* ninth_m2,
                 const Spread& out) noexcept {
  HWY_DYNAMIC_DISPATCH(FitPatches)(image, at, ninth_m2, out);
}
void jumps(const RangePlanes& image, const JumpPlanes& planes, std::ptrdiff_t at,
           std::ptrdiff_t step, float* out) noexcept {
  HWY_DYNAMIC_DISPATCH(Jumps)(image, planes, at, step, out);
}
void beam_spread(const RangePlanes& normals, const float* code, std::ptrdiff_t at, float* count,
                 const Spread& out) noexcept {
  HWY_DYNAMIC_DISPATCH(BeamSpread)(normals, code, at, count, out);
}

}  // namespace grapnel::kernels
#endif
