#include "pipeline/kernels/near_plane.h"

#include <cmath>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pipeline/kernels/near_plane.cpp"
#include "hwy/foreach_target.h"
#include "hwy/highway.h"

HWY_BEFORE_NAMESPACE();
namespace grapnel {
namespace kernels {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/// Of the first `count` samples, a whole number of vectors.
std::size_t CountNearPlane(const InverseSamples& samples, std::size_t count, float a, float b,
                           float c) {
  const hn::CappedTag<float, 8> d;
  const auto plane_a = hn::Set(d, a);
  const auto plane_b = hn::Set(d, b);
  const auto plane_c = hn::Set(d, c);
  const auto one = hn::Set(d, 1.0F);
  // Whole numbers far below 2^24, so their order is of no account.
  auto near = hn::Zero(d);
  for (std::size_t i = 0; i < count; i += hn::Lanes(d)) {
    const auto au = hn::Mul(plane_a, hn::LoadU(d, samples.u + i));
    const auto bv = hn::Mul(plane_b, hn::LoadU(d, samples.v + i));
    const auto on_plane = hn::Add(hn::Add(au, bv), plane_c);
    const auto off = hn::Abs(hn::Sub(hn::LoadU(d, samples.inverse + i), on_plane));
    const auto is_near = hn::Le(off, hn::LoadU(d, samples.tolerance + i));
    near = hn::Add(near, hn::IfThenElseZero(is_near, one));
  }
  return static_cast<std::size_t>(hn::GetLane(hn::SumOfLanes(d, near)));
}

}  // namespace HWY_NAMESPACE
}  // namespace kernels
}  // namespace grapnel
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace grapnel::kernels {

HWY_EXPORT(CountNearPlane);

std::size_t count_near_plane(const InverseSamples& samples, std::size_t count, float a, float b,
                             float c) noexcept {
  constexpr std::size_t kWhole = 8;
  const std::size_t whole = count / kWhole * kWhole;
  const std::size_t near = HWY_DYNAMIC_DISPATCH(CountNearPlane)(samples, whole, a, b, c);
  const InverseSamples rest{samples.u + whole, samples.v + whole, samples.inverse + whole,
                            samples.tolerance + whole};
  return near + reference::count_near_plane(rest, count - whole, a, b, c);
}

namespace reference {

std::size_t count_near_plane(const InverseSamples& samples, std::size_t count, float a, float b,
                             float c) noexcept {
  std::size_t near = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const float residual = samples.inverse[i] - (a * samples.u[i] + b * samples.v[i] + c);
    near += std::fabs(residual) <= samples.tolerance[i] ? 1 : 0;
  }
  return near;
}

}  // namespace reference
}  // namespace grapnel::kernels
#endif
