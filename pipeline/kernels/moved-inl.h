// Included once per SIMD target.
#if defined(GRAPNEL_KERNELS_MOVED_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef GRAPNEL_KERNELS_MOVED_INL_H_
#undef GRAPNEL_KERNELS_MOVED_INL_H_
#else
#define GRAPNEL_KERNELS_MOVED_INL_H_
#endif

#include "hwy/highway.h"
#include "pipeline/kernels/moved.h"

HWY_BEFORE_NAMESPACE();
namespace grapnel {
namespace kernels {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::CappedTag<float, kLanes>;
using Ints = hn::RebindToSigned<Floats>;
using VF = hn::Vec<Floats>;
using VI = hn::Vec<Ints>;

struct Vec3 {
  VF x, y, z;
};

HWY_INLINE Vec3 Load3(const float* x, const float* y, const float* z) {
  const Floats d;
  return {hn::LoadU(d, x), hn::LoadU(d, y), hn::LoadU(d, z)};
}

HWY_INLINE VF Dot(const Vec3& a, const Vec3& b) {
  return hn::Add(hn::Add(hn::Mul(a.x, b.x), hn::Mul(a.y, b.y)), hn::Mul(a.z, b.z));
}

HWY_INLINE Vec3 Minus(const Vec3& a, const Vec3& b) {
  return {hn::Sub(a.x, b.x), hn::Sub(a.y, b.y), hn::Sub(a.z, b.z)};
}

/// A motion held in registers, or reloaded from the stack where there are too few.
struct MotionVectors {
  VF r[9], t[3];
  explicit MotionVectors(const Motion& motion) {
    const Floats d;
    for (int i = 0; i < 9; ++i) r[i] = hn::Set(d, motion.r[i]);
    for (int i = 0; i < 3; ++i) t[i] = hn::Set(d, motion.t[i]);
  }
  HWY_INLINE Vec3 Rotate(const Vec3& v) const {
    return {Dot({r[0], r[1], r[2]}, v), Dot({r[3], r[4], r[5]}, v), Dot({r[6], r[7], r[8]}, v)};
  }
  HWY_INLINE Vec3 Move(const Vec3& v) const {
    const Vec3 turned = Rotate(v);
    return {hn::Add(turned.x, t[0]), hn::Add(turned.y, t[1]), hn::Add(turned.z, t[2])};
  }
};

/// Index of the voxel that holds each point, -1 outside of the box.
HWY_INLINE VI VoxelOf(const VoxelShape& shape, const Vec3& p) {
  const Floats d;
  const Ints di;
  const VF per_metre = hn::Set(d, shape.per_metre);
  const VF zero = hn::Zero(d);
  const VF px = hn::Mul(hn::Sub(p.x, hn::Set(d, shape.origin[0])), per_metre);
  const VF py = hn::Mul(hn::Sub(p.y, hn::Set(d, shape.origin[1])), per_metre);
  const VF pz = hn::Mul(hn::Sub(p.z, hn::Set(d, shape.origin[2])), per_metre);
  const VF end_x = hn::Set(d, static_cast<float>(shape.size[0]));
  const VF end_y = hn::Set(d, static_cast<float>(shape.size[1]));
  const VF end_z = hn::Set(d, static_cast<float>(shape.size[2]));
  const auto low = hn::And(hn::And(hn::Ge(px, zero), hn::Ge(py, zero)), hn::Ge(pz, zero));
  const auto high = hn::And(hn::And(hn::Lt(px, end_x), hn::Lt(py, end_y)), hn::Lt(pz, end_z));
  const auto inside = hn::And(low, high);
  // Masked before the conversion: what doesn't fit an int has no defined value.
  const VI x = hn::ConvertTo(di, hn::IfThenElseZero(inside, px));
  const VI y = hn::ConvertTo(di, hn::IfThenElseZero(inside, py));
  const VI z = hn::ConvertTo(di, hn::IfThenElseZero(inside, pz));
  const VI row = hn::Add(hn::Mul(z, hn::Set(di, shape.size[1])), y);
  const VI voxel = hn::Add(hn::Mul(row, hn::Set(di, shape.size[0])), x);
  return hn::IfThenElse(hn::RebindMask(di, inside), voxel, hn::Set(di, -1));
}

}  // namespace HWY_NAMESPACE
}  // namespace kernels
}  // namespace grapnel
HWY_AFTER_NAMESPACE();

#endif  // GRAPNEL_KERNELS_MOVED_INL_H_
