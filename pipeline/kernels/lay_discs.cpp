#include "pipeline/kernels/lay_discs.h"

#include <algorithm>
#include <cmath>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pipeline/kernels/lay_discs.cpp"
#include "hwy/foreach_target.h"
#include "hwy/highway.h"
#include "pipeline/kernels/moved-inl.h"

HWY_BEFORE_NAMESPACE();
namespace grapnel {
namespace kernels {
namespace HWY_NAMESPACE {

// Farther from the image's origin a point is out of every view.
constexpr float kFarOff_px = 1e5F;

/// Eight discs, field by field.
struct DiscFields {
  alignas(64) float start[kLanes], step_u[kLanes], step_v[kLanes], nearest[kLanes],
      farthest[kLanes];
  alignas(64) std::int32_t u0[kLanes], u1[kLanes], v0[kLanes], v1[kLanes];
  alignas(64) std::int32_t drawn[kLanes];
};

HWY_INLINE VF DotFromLast(const Vec3& a, const Vec3& b) {
  return hn::Add(hn::Mul(a.x, b.x), hn::Add(hn::Mul(a.y, b.y), hn::Mul(a.z, b.z)));
}

HWY_INLINE Vec3 Turned(const MotionVectors& m, const Vec3& v) {
  return {DotFromLast({m.r[0], m.r[1], m.r[2]}, v), DotFromLast({m.r[3], m.r[4], m.r[5]}, v),
          DotFromLast({m.r[6], m.r[7], m.r[8]}, v)};
}

/// Pixel of a coordinate where `inside`, else 0.
HWY_INLINE VI PixelOf(VF at, hn::Mask<Floats> inside) {
  const Floats d;
  return hn::ConvertTo(Ints(),
                       hn::IfThenElseZero(inside, hn::Floor(hn::Add(at, hn::Set(d, 0.5F)))));
}

HWY_INLINE void LaySome(const Vec3& point, const Vec3& own_normal, const MotionVectors& m,
                        const DiscLaw& law, std::size_t lane, DiscFields& out) {
  const Floats d;
  const Ints di;
  const VF one = hn::Set(d, 1.0F);
  const VF zero = hn::Zero(d);
  const VF fx = hn::Set(d, law.fx);
  const VF fy = hn::Set(d, law.fy);
  const VF cx = hn::Set(d, law.cx);
  const VF cy = hn::Set(d, law.cy);
  const Vec3 turned = Turned(m, point);
  const Vec3 x = {hn::Add(turned.x, m.t[0]), hn::Add(turned.y, m.t[1]), hn::Add(turned.z, m.t[2])};
  const Vec3 n = Turned(m, own_normal);
  const VF along = DotFromLast(n, x);
  const VF least = hn::Mul(hn::Set(d, law.least_cosine_square), DotFromLast(x, x));
  const auto before = hn::Gt(x.z, hn::Set(d, 1e-6F));
  const auto faces = hn::And(hn::Lt(along, zero), hn::Ge(hn::Mul(along, along), least));

  const VF inverse_z = hn::Div(one, x.z);
  const VF uc = hn::Add(hn::Mul(hn::Mul(fx, x.x), inverse_z), cx);
  const VF vc = hn::Add(hn::Mul(hn::Mul(fy, x.y), inverse_z), cy);
  const VF far_off = hn::Set(d, kFarOff_px);
  const auto near = hn::And(hn::Lt(hn::Abs(uc), far_off), hn::Lt(hn::Abs(vc), far_off));
  const auto seen = hn::And(hn::And(before, faces), near);
  const VF radius = hn::Set(d, law.radius_m);
  const VF reach = hn::Min(hn::Set(d, law.most_px), hn::Mul(hn::Mul(radius, fx), inverse_z));
  const VI one_px = hn::Set(di, 1);
  const VI u0 = hn::Max(hn::Set(di, law.u0), PixelOf(hn::Sub(uc, reach), seen));
  const VI u1 = hn::Min(hn::Sub(hn::Set(di, law.u1), one_px), PixelOf(hn::Add(uc, reach), seen));
  const VI v0 = hn::Max(hn::Set(di, law.v0), PixelOf(hn::Sub(vc, reach), seen));
  const VI v1 = hn::Min(hn::Sub(hn::Set(di, law.v1), one_px), PixelOf(hn::Add(vc, reach), seen));
  const auto empty = hn::Or(hn::Gt(u0, u1), hn::Gt(v0, v1));
  const auto drawn = hn::AndNot(empty, hn::RebindMask(di, seen));

  // 1/z of the disc's plane is affine in the pixel. A steep disc is met far off by the ray, though
  // its own edge is near the pixel: kept within its reach.
  const VF over_plane = hn::Div(one, along);
  const VF step_u = hn::Div(hn::Mul(n.x, over_plane), fx);
  const VF step_v = hn::Div(hn::Mul(n.y, over_plane), fy);
  const VF start =
      hn::Sub(hn::Sub(hn::Mul(n.z, over_plane), hn::Mul(cx, step_u)), hn::Mul(cy, step_v));
  const VF depth = hn::Mul(hn::Set(d, 2.0F), radius);
  const VF front = hn::Max(hn::Sub(x.z, depth), hn::Mul(hn::Set(d, 0.1F), x.z));
  hn::Store(start, d, out.start + lane);
  hn::Store(step_u, d, out.step_u + lane);
  hn::Store(step_v, d, out.step_v + lane);
  hn::Store(hn::Div(one, front), d, out.nearest + lane);
  hn::Store(hn::Div(one, hn::Add(x.z, depth)), d, out.farthest + lane);
  hn::Store(u0, di, out.u0 + lane);
  hn::Store(u1, di, out.u1 + lane);
  hn::Store(v0, di, out.v0 + lane);
  hn::Store(v1, di, out.v1 + lane);
  hn::Store(hn::VecFromMask(di, drawn), di, out.drawn + lane);
}

std::size_t Append(const DiscFields& fields, std::size_t first, std::size_t count, Disc* discs,
                   DiscBounds& bounds) {
  std::size_t made = 0;
  for (std::size_t k = 0; k < count; ++k) {
    if (fields.drawn[k] == 0) continue;
    discs[made++] = {fields.start[k],    fields.step_u[k],
                     fields.step_v[k],   fields.nearest[k],
                     fields.farthest[k], fields.u0[k],
                     fields.u1[k],       fields.v0[k],
                     fields.v1[k],       static_cast<std::int32_t>(first + k)};
    bounds.u0 = std::min(bounds.u0, fields.u0[k]);
    bounds.v0 = std::min(bounds.v0, fields.v0[k]);
    bounds.u1 = std::max(bounds.u1, fields.u1[k] + 1);
    bounds.v1 = std::max(bounds.v1, fields.v1[k] + 1);
  }
  return made;
}

std::size_t LayDiscs(const OrientedPlanes& points, std::size_t first, std::size_t count,
                     const Motion& motion, const DiscLaw& law, Disc* discs, DiscBounds& bounds) {
  const Floats d;
  const MotionVectors m(motion);
  DiscFields fields;
  std::size_t made = 0;
  const std::size_t end = first + count;
  for (; first + kLanes <= end; first += kLanes) {
    for (std::size_t lane = 0; lane < kLanes; lane += hn::Lanes(d)) {
      const std::size_t i = first + lane;
      LaySome(Load3(points.x + i, points.y + i, points.z + i),
              Load3(points.nx + i, points.ny + i, points.nz + i), m, law, lane, fields);
    }
    made += Append(fields, first, kLanes, discs + made, bounds);
  }
  if (first == end) return made;
  alignas(64) float rest[6][kLanes] = {};
  const float* const planes[6] = {points.x, points.y, points.z, points.nx, points.ny, points.nz};
  for (int k = 0; k < 6; ++k) std::copy(planes[k] + first, planes[k] + end, rest[k]);
  for (std::size_t lane = 0; lane < kLanes; lane += hn::Lanes(d)) {
    LaySome(Load3(rest[0] + lane, rest[1] + lane, rest[2] + lane),
            Load3(rest[3] + lane, rest[4] + lane, rest[5] + lane), m, law, lane, fields);
  }
  return made + Append(fields, first, end - first, discs + made, bounds);
}

}  // namespace HWY_NAMESPACE
}  // namespace kernels
}  // namespace grapnel
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace grapnel::kernels {

HWY_EXPORT(LayDiscs);

std::size_t lay_discs(const OrientedPlanes& points, std::size_t first, std::size_t count,
                      const Motion& motion, const DiscLaw& law, Disc* discs,
                      DiscBounds& bounds) noexcept {
  return HWY_DYNAMIC_DISPATCH(LayDiscs)(points, first, count, motion, law, discs, bounds);
}

namespace reference {
namespace {

bool disc_of(const Vec3f& x, const Vec3f& normal, const DiscLaw& law, Disc& disc) noexcept {
  if (!(x.z() > 1e-6F)) return false;
  const float along = normal.dot(x);
  if (!(along < 0.0F) || along * along < law.least_cosine_square * x.squaredNorm()) return false;
  const float inverse_z = 1.0F / x.z();
  const float uc = law.fx * x.x() * inverse_z + law.cx;
  const float vc = law.fy * x.y() * inverse_z + law.cy;
  if (!(std::fabs(uc) < 1e5F && std::fabs(vc) < 1e5F)) return false;
  const float reach = std::min(law.most_px, law.radius_m * law.fx * inverse_z);
  disc.u0 = std::max(law.u0, static_cast<std::int32_t>(std::floor(uc - reach + 0.5F)));
  disc.u1 = std::min(law.u1 - 1, static_cast<std::int32_t>(std::floor(uc + reach + 0.5F)));
  disc.v0 = std::max(law.v0, static_cast<std::int32_t>(std::floor(vc - reach + 0.5F)));
  disc.v1 = std::min(law.v1 - 1, static_cast<std::int32_t>(std::floor(vc + reach + 0.5F)));
  if (disc.u0 > disc.u1 || disc.v0 > disc.v1) return false;
  const float over_plane = 1.0F / along;
  disc.step_u = normal.x() * over_plane / law.fx;
  disc.step_v = normal.y() * over_plane / law.fy;
  disc.start = normal.z() * over_plane - law.cx * disc.step_u - law.cy * disc.step_v;
  disc.nearest = 1.0F / std::max(x.z() - 2.0F * law.radius_m, 0.1F * x.z());
  disc.farthest = 1.0F / (x.z() + 2.0F * law.radius_m);
  return true;
}

}  // namespace

std::size_t lay_discs(const OrientedPlanes& points, std::size_t first, std::size_t count,
                      const Motion& motion, const DiscLaw& law, Disc* discs,
                      DiscBounds& bounds) noexcept {
  Eigen::Matrix3f rotation;
  for (int k = 0; k < 9; ++k) rotation(k / 3, k % 3) = motion.r[k];
  const Vec3f shift(motion.t[0], motion.t[1], motion.t[2]);
  std::size_t made = 0;
  for (std::size_t i = first; i < first + count; ++i) {
    const Vec3f x = rotation * Vec3f(points.x[i], points.y[i], points.z[i]) + shift;
    Disc disc;
    disc.point = static_cast<std::int32_t>(i);
    if (!disc_of(x, rotation * Vec3f(points.nx[i], points.ny[i], points.nz[i]), law, disc)) {
      continue;
    }
    discs[made++] = disc;
    bounds.u0 = std::min(bounds.u0, disc.u0);
    bounds.v0 = std::min(bounds.v0, disc.v0);
    bounds.u1 = std::max(bounds.u1, disc.u1 + 1);
    bounds.v1 = std::max(bounds.v1, disc.v1 + 1);
  }
  return made;
}

}  // namespace reference
}  // namespace grapnel::kernels
#endif
