#include "pipeline/kernels/compare_row.h"

#include <algorithm>
#include <cmath>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pipeline/kernels/compare_row.cpp"
#include "hwy/foreach_target.h"
#include "hwy/highway.h"
#include "pipeline/kernels/moved-inl.h"

HWY_BEFORE_NAMESPACE();
namespace grapnel {
namespace kernels {
namespace HWY_NAMESPACE {

HWY_INLINE VI Code(Met met) { return hn::Set(Ints(), static_cast<std::int32_t>(met)); }

/// Where the prediction ends or bends by more than the limit within the rim: a slope has no second
/// difference, a step has.
HWY_INLINE hn::Mask<Floats> AtStep(const float* at, std::ptrdiff_t apart, VF z, VF limit) {
  const Floats d;
  const VF after = hn::LoadU(d, at + apart);
  const VF before = hn::LoadU(d, at - apart);
  const auto ends = hn::Not(hn::Gt(hn::Min(after, before), hn::Zero(d)));
  const VF bend = hn::Abs(hn::Sub(hn::Add(after, before), hn::Mul(hn::Set(d, 2.0F), z)));
  return hn::Or(ends, hn::Gt(bend, limit));
}

void CompareRow(const PredictedRow& predicted, const float* measured, std::size_t count,
                const Motion& motion, const CompareLaw& law, const ComparedRow& out) {
  const Floats d;
  const Ints di;
  const MotionVectors m(motion);
  const VF zero = hn::Zero(d);
  const VF one = hn::Set(d, 1.0F);
  const VF y = hn::Set(d, law.y);
  const VF y_square = hn::Set(d, law.y * law.y);
  for (std::size_t k = 0; k < count; k += hn::Lanes(d)) {
    const float* const at = predicted.z + k;
    const VF z = hn::LoadU(d, at);
    const VF sigma = hn::Max(hn::Mul(hn::Mul(hn::Set(d, law.sigma_per_m2), z), z),
                             hn::Set(d, law.sigma_floor_m));
    const VF limit = hn::Max(hn::Mul(hn::Set(d, law.sigmas), sigma), hn::Set(d, law.floor_m));
    const auto step = hn::Or(AtStep(at, law.rim_px, z, limit),
                             AtStep(at, law.rim_px * predicted.width, z, limit));

    const VF x = hn::Add(hn::Set(d, law.first_x),
                         hn::Mul(hn::Set(d, law.step_x), hn::Iota(d, static_cast<float>(k))));
    const Vec3 n = m.Rotate(Load3(predicted.nx + k, predicted.ny + k, predicted.nz + k));
    const VF toward = hn::Neg(Dot(n, {x, y, one}));
    const VF length = hn::Sqrt(hn::Add(hn::Add(hn::Mul(x, x), y_square), one));
    const VF along = hn::Max(toward, hn::Mul(hn::Set(d, law.least_cosine), length));
    const VF signed_z = hn::LoadU(d, measured + k);
    const VF off = hn::Mul(hn::Sub(hn::Abs(signed_z), z), along);

    const auto ground = hn::RebindMask(di, hn::Lt(signed_z, zero));
    VI met = hn::IfThenElse(ground, Code(Met::Ground), Code(Met::Within));
    met = hn::IfThenElse(hn::RebindMask(di, hn::Gt(off, limit)), Code(Met::Behind), met);
    met = hn::IfThenElse(hn::RebindMask(di, hn::Lt(off, hn::Neg(limit))), Code(Met::Before), met);
    met = hn::IfThenElse(hn::RebindMask(di, hn::Eq(signed_z, zero)), Code(Met::NoReading), met);
    met = hn::IfThenElse(hn::RebindMask(di, step), Code(Met::AtStep), met);
    met = hn::IfThenElseZero(hn::RebindMask(di, hn::Gt(z, zero)), met);
    hn::StoreU(met, di, out.met + k);
    hn::StoreU(off, d, out.off_m + k);
    hn::StoreU(hn::Div(hn::Mul(z, z), along), d, out.footprint_m2 + k);
    hn::StoreU(n.x, d, out.nx + k);
    hn::StoreU(n.y, d, out.ny + k);
    hn::StoreU(n.z, d, out.nz + k);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace kernels
}  // namespace grapnel
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace grapnel::kernels {

HWY_EXPORT(CompareRow);

void compare_row(const PredictedRow& predicted, const float* measured, std::size_t count,
                 const Motion& motion, const CompareLaw& law, const ComparedRow& out) noexcept {
  HWY_DYNAMIC_DISPATCH(CompareRow)(predicted, measured, count, motion, law, out);
}

namespace reference {
namespace {

bool at_step(const float* at, std::ptrdiff_t apart, float limit) noexcept {
  const float after = at[apart];
  const float before = at[-apart];
  if (!(after > 0.0F && before > 0.0F)) return true;
  return std::fabs(after + before - 2.0F * *at) > limit;
}

Met met_by(float off, float limit, float measured) noexcept {
  if (measured == 0.0F) return Met::NoReading;
  if (off > limit) return Met::Behind;
  if (off < -limit) return Met::Before;
  return measured < 0.0F ? Met::Ground : Met::Within;
}

}  // namespace

void compare_row(const PredictedRow& predicted, const float* measured, std::size_t count,
                 const Motion& motion, const CompareLaw& law, const ComparedRow& out) noexcept {
  for (std::size_t k = 0; k < count; ++k) {
    const float* const at = predicted.z + k;
    const float z = *at;
    const float sigma_m = std::max(law.sigma_per_m2 * z * z, law.sigma_floor_m);
    const float limit = std::max(law.sigmas * sigma_m, law.floor_m);
    const float n[3] = {predicted.nx[k], predicted.ny[k], predicted.nz[k]};
    float turned[3];
    for (int row = 0; row < 3; ++row) {
      const float* r = motion.r + static_cast<std::ptrdiff_t>(3) * row;
      turned[row] = r[0] * n[0] + r[1] * n[1] + r[2] * n[2];
    }
    const float x = law.first_x + law.step_x * static_cast<float>(k);
    const float toward = -(turned[0] * x + turned[1] * law.y + turned[2]);
    const float length = std::sqrt(x * x + law.y * law.y + 1.0F);
    const float along = std::max(toward, law.least_cosine * length);
    out.off_m[k] = (std::fabs(measured[k]) - z) * along;
    out.footprint_m2[k] = z * z / along;
    out.nx[k] = turned[0];
    out.ny[k] = turned[1];
    out.nz[k] = turned[2];
    const bool step = z > 0.0F && (at_step(at, law.rim_px, limit) ||
                                   at_step(at, law.rim_px * predicted.width, limit));
    const Met met = !(z > 0.0F) ? Met::Nothing
                    : step      ? Met::AtStep
                                : met_by(out.off_m[k], limit, measured[k]);
    out.met[k] = static_cast<std::int32_t>(met);
  }
}

}  // namespace reference
}  // namespace grapnel::kernels
#endif
