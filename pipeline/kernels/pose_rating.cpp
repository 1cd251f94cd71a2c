#include "pipeline/kernels/pose_rating.h"

#include <algorithm>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pipeline/kernels/pose_rating.cpp"
#include "hwy/foreach_target.h"
#include "hwy/highway.h"
#include "pipeline/kernels/moved-inl.h"

HWY_BEFORE_NAMESPACE();
namespace grapnel {
namespace kernels {
namespace HWY_NAMESPACE {

// Samples between two visits of the look-up table: the arrays stay in the nearest cache, and the
// processor can fetch many entries at once.
constexpr std::size_t kStretch = 64;

HWY_INLINE void AddTo(float* sum, VF value) {
  const Floats d;
  hn::Store(hn::Add(hn::Load(d, sum), value), d, sum);
}

/// 1 at no distance, 0 at the tolerance, whose inverse square is given.
HWY_INLINE VF Closeness(VF square, VF per_square) {
  return hn::Sub(hn::Set(Floats(), 1.0F), hn::Mul(square, per_square));
}

/// All ones in the lanes of samples that are there.
HWY_INLINE hn::Mask<Floats> There(std::size_t i, std::size_t count) {
  const Ints di;
  const VI here = hn::Iota(di, static_cast<std::int32_t>(i));
  return hn::RebindMask(Floats(), hn::Lt(here, hn::Set(di, static_cast<std::int32_t>(count))));
}

struct SightStretch {
  alignas(64) float cosine[kStretch];     // to the ray; 0: does not face the camera
  alignas(64) float predicted[kStretch];  // z
  alignas(64) float measured[kStretch];   // signed
  alignas(64) std::int32_t at[kStretch];  // pixel; 0 outside of the image
  alignas(64) float inside[kStretch];     // 1 or 0
};

HWY_INLINE void Project(const OrientedPlanes& samples, std::size_t first, std::size_t end,
                        std::size_t count, const MotionVectors& m, const SignedDepth& pixels,
                        const SightLaw& law, SightStretch& out) {
  const Floats d;
  const Ints di;
  const VF zero = hn::Zero(d);
  const VF least = hn::Set(d, law.cos_facing * law.cos_facing);
  const VF width = hn::Set(d, static_cast<float>(pixels.width));
  const VF height = hn::Set(d, static_cast<float>(pixels.height));
  for (std::size_t i = first; i < end; i += hn::Lanes(d)) {
    const Vec3 p = m.Move(Load3(samples.x + i, samples.y + i, samples.z + i));
    const Vec3 n = m.Rotate(Load3(samples.nx + i, samples.ny + i, samples.nz + i));
    const VF toward = hn::Neg(Dot(n, p));
    const VF range_square = Dot(p, p);
    const auto front = hn::And(hn::Gt(toward, zero), hn::Gt(p.z, zero));
    const auto steep = hn::Ge(hn::Mul(toward, toward), hn::Mul(least, range_square));
    const auto faces = hn::And(hn::And(front, steep), There(i, count));
    const VF u = hn::Add(hn::Div(hn::Mul(hn::Set(d, pixels.fx), p.x), p.z), hn::Set(d, pixels.cx));
    const VF v = hn::Add(hn::Div(hn::Mul(hn::Set(d, pixels.fy), p.y), p.z), hn::Set(d, pixels.cy));
    const auto low = hn::And(hn::Ge(u, zero), hn::Ge(v, zero));
    const auto high = hn::And(hn::Lt(u, width), hn::Lt(v, height));
    const auto inside = hn::And(hn::And(low, high), faces);
    // Masked before the conversion: what doesn't fit an int has no defined value.
    const VI column = hn::ConvertTo(di, hn::IfThenElseZero(inside, u));
    const VI row = hn::ConvertTo(di, hn::IfThenElseZero(inside, v));
    hn::Store(hn::Add(hn::Mul(row, hn::Set(di, pixels.width)), column), di, out.at + i - first);
    hn::Store(hn::IfThenElseZero(faces, hn::Div(toward, hn::Sqrt(range_square))), d,
              out.cosine + i - first);
    hn::Store(p.z, d, out.predicted + i - first);
    hn::Store(hn::IfThenElseZero(inside, hn::Set(d, 1.0F)), d, out.inside + i - first);
  }
}

HWY_INLINE void Compare(const SightStretch& stretch, std::size_t count, const SightLaw& law,
                        float* facing, float* worth) {
  const Floats d;
  const VF zero = hn::Zero(d);
  const VF tolerance = hn::Set(d, law.tolerance_m);
  const VF per_square = hn::Set(d, 1.0F / (law.tolerance_m * law.tolerance_m));
  const VF no_reading = hn::Set(d, -law.no_reading);
  const VF hidden = hn::Set(d, -law.hidden);
  const VF seen_through = hn::Set(d, -law.seen_through);
  for (std::size_t k = 0; k < count; k += hn::Lanes(d)) {
    const VF cosine = hn::Load(d, stretch.cosine + k);
    const VF signed_z = hn::Mul(hn::Load(d, stretch.measured + k), hn::Load(d, stretch.inside + k));
    // Of the measured point from the sample's tangent plane, positive behind it.
    const VF off = hn::Mul(hn::Sub(hn::Abs(signed_z), hn::Load(d, stretch.predicted + k)), cosine);
    const VF met =
        hn::IfThenElseZero(hn::Gt(signed_z, zero), Closeness(hn::Mul(off, off), per_square));
    const VF missed = hn::IfThenElse(hn::Gt(off, zero), seen_through, hidden);
    const VF read = hn::IfThenElse(hn::Lt(hn::Abs(off), tolerance), met, missed);
    const VF each = hn::IfThenElse(hn::Eq(signed_z, zero), no_reading, read);
    const std::size_t lane = k % kLanes;
    AddTo(facing + lane, cosine);
    // A sample that doesn't face the camera may have any z: its product could be no number.
    AddTo(worth + lane, hn::IfThenElseZero(hn::Gt(cosine, zero), hn::Mul(cosine, each)));
  }
}

Sight RateSight(const OrientedPlanes& samples, std::size_t count, const Motion& motion,
                const SignedDepth& pixels, const SightLaw& law) {
  const MotionVectors m(motion);
  SightStretch stretch;
  alignas(64) float facing[kLanes] = {};
  alignas(64) float worth[kLanes] = {};
  for (std::size_t first = 0; first < count; first += kStretch) {
    const std::size_t end = std::min(in_lanes(count), first + kStretch);
    Project(samples, first, end, count, m, pixels, law, stretch);
    for (std::size_t k = 0; k < end - first; ++k) stretch.measured[k] = pixels.z[stretch.at[k]];
    Compare(stretch, end - first, law, facing, worth);
  }
  return {fold_lanes(facing), fold_lanes(worth)};
}

/// Points that voxels name, fetched one by one: sooner than gathering them.
struct NamedStretch {
  alignas(64) std::int32_t voxel[kStretch];  // -1 outside
  alignas(64) float x[kStretch], y[kStretch], z[kStretch];
  alignas(64) float nx[kStretch], ny[kStretch], nz[kStretch];
};

HWY_INLINE void FetchNamed(const NamedSurface& surface, std::size_t count, NamedStretch& named) {
  const OrientedPlanes& points = surface.points;
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t at = surface.named[std::max(named.voxel[k], 0)];
    named.x[k] = points.x[at];
    named.y[k] = points.y[at];
    named.z[k] = points.z[at];
    named.nx[k] = points.nx[at];
    named.ny[k] = points.ny[at];
    named.nz[k] = points.nz[at];
  }
}

float RateOnSurface(const OrientedPlanes& samples, std::size_t count, const Motion& motion,
                    const NamedSurface& surface, float tolerance_m, float cos_normal) {
  const Floats d;
  const Ints di;
  const MotionVectors m(motion);
  const VF per_square = hn::Set(d, 1.0F / (tolerance_m * tolerance_m));
  const VF limit = hn::Set(d, tolerance_m * tolerance_m);
  const VF half = hn::Set(d, 0.5F);
  alignas(64) float sum[kLanes] = {};
  NamedStretch named;
  for (std::size_t first = 0; first < count; first += kStretch) {
    const std::size_t end = std::min(in_lanes(count), first + kStretch);
    for (std::size_t i = first; i < end; i += hn::Lanes(d)) {
      const Vec3 p = m.Move(Load3(samples.x + i, samples.y + i, samples.z + i));
      hn::Store(VoxelOf(surface.voxels, p), di, named.voxel + i - first);
    }
    FetchNamed(surface, end - first, named);
    for (std::size_t i = first; i < end; i += hn::Lanes(d)) {
      const std::size_t k = i - first;
      const auto inside =
          hn::And(hn::RebindMask(d, hn::Gt(hn::Load(di, named.voxel + k), hn::Set(di, -1))),
                  There(i, count));
      const Vec3 p = m.Move(Load3(samples.x + i, samples.y + i, samples.z + i));
      const Vec3 gap = Minus(Load3(named.x + k, named.y + k, named.z + k), p);
      const VF square = Dot(gap, gap);
      const auto near = hn::And(inside, hn::Lt(square, limit));
      if (hn::AllFalse(d, near)) continue;
      const Vec3 own = m.Rotate(Load3(samples.nx + i, samples.ny + i, samples.nz + i));
      const VF cosine = Dot(own, Load3(named.nx + k, named.ny + k, named.nz + k));
      const auto turned_away =
          hn::And(hn::Gt(Dot(own, own), half), hn::Lt(cosine, hn::Set(d, cos_normal)));
      AddTo(sum + i % kLanes,
            hn::IfThenElseZero(hn::AndNot(turned_away, near), Closeness(square, per_square)));
    }
  }
  return fold_lanes(sum);
}

float RateInField(const OrientedPlanes& samples, std::size_t count, const Motion& motion,
                  const LevelField& field) {
  const Floats d;
  const MotionVectors m(motion);
  alignas(64) std::int32_t voxel[kStretch];
  float sum[kLanes] = {};
  for (std::size_t first = 0; first < count; first += kStretch) {
    const std::size_t end = std::min(in_lanes(count), first + kStretch);
    for (std::size_t i = first; i < end; i += hn::Lanes(d)) {
      const Vec3 p = m.Move(Load3(samples.x + i, samples.y + i, samples.z + i));
      hn::Store(VoxelOf(field.voxels, p), Ints(), voxel + i - first);
    }
    for (std::size_t k = 0; k < std::min(count, end) - first; ++k) {
      if (voxel[k] >= 0) sum[k % kLanes] += field.worth[field.level[voxel[k]]];
    }
  }
  return fold_lanes(sum);
}

}  // namespace HWY_NAMESPACE
}  // namespace kernels
}  // namespace grapnel
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace grapnel::kernels {

HWY_EXPORT(RateSight);
HWY_EXPORT(RateOnSurface);
HWY_EXPORT(RateInField);

Sight rate_sight(const OrientedPlanes& samples, std::size_t count, const Motion& motion,
                 const SignedDepth& pixels, const SightLaw& law) noexcept {
  return HWY_DYNAMIC_DISPATCH(RateSight)(samples, count, motion, pixels, law);
}

float rate_on_surface(const OrientedPlanes& samples, std::size_t count, const Motion& motion,
                      const NamedSurface& surface, float tolerance_m, float cos_normal) noexcept {
  return HWY_DYNAMIC_DISPATCH(RateOnSurface)(samples, count, motion, surface, tolerance_m,
                                             cos_normal);
}

float rate_in_field(const OrientedPlanes& samples, std::size_t count, const Motion& motion,
                    const LevelField& field) noexcept {
  return HWY_DYNAMIC_DISPATCH(RateInField)(samples, count, motion, field);
}

}  // namespace grapnel::kernels
#endif
