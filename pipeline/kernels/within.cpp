#include "pipeline/kernels/within.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pipeline/kernels/within.cpp"
#include "hwy/foreach_target.h"
#include "hwy/highway.h"

HWY_BEFORE_NAMESPACE();
namespace grapnel {
namespace kernels {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

std::size_t SelectWithin(const PointPlanes& points, std::span<const PointRange> ranges,
                         const Sphere& sphere, std::int32_t* HWY_RESTRICT position,
                         float* HWY_RESTRICT squared_m2) {
  const hn::CappedTag<float, 8> df;
  const hn::RebindToSigned<decltype(df)> di;
  const auto lanes = static_cast<std::int32_t>(hn::Lanes(df));
  const auto cx = hn::Set(df, sphere.x);
  const auto cy = hn::Set(df, sphere.y);
  const auto cz = hn::Set(df, sphere.z);
  const auto limit = hn::Set(df, sphere.squared_m2);
  const auto count_up = hn::Iota(di, 0);
  std::size_t found = 0;
  for (const PointRange& range : ranges) {
    for (std::int32_t i = range.begin; i < range.end; i += lanes) {
      const auto dx = hn::Sub(hn::LoadU(df, points.x + i), cx);
      const auto dy = hn::Sub(hn::LoadU(df, points.y + i), cy);
      const auto dz = hn::Sub(hn::LoadU(df, points.z + i), cz);
      const auto squared = hn::Add(hn::Add(hn::Mul(dx, dx), hn::Mul(dy, dy)), hn::Mul(dz, dz));
      const auto here = hn::Add(hn::Set(di, i), count_up);
      const auto in_range = hn::RebindMask(df, hn::Lt(here, hn::Set(di, range.end)));
      const auto inside = hn::And(in_range, hn::Le(squared, limit));
      if (hn::AllFalse(df, inside)) continue;
      hn::CompressStore(here, hn::RebindMask(di, inside), di, position + found);
      found += hn::CompressStore(squared, inside, df, squared_m2 + found);
    }
  }
  return found;
}

}  // namespace HWY_NAMESPACE
}  // namespace kernels
}  // namespace grapnel
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace grapnel::kernels {

HWY_EXPORT(SelectWithin);

std::size_t select_within(const PointPlanes& points, std::span<const PointRange> ranges,
                          const Sphere& sphere, std::int32_t* position,
                          float* squared_m2) noexcept {
  return HWY_DYNAMIC_DISPATCH(SelectWithin)(points, ranges, sphere, position, squared_m2);
}

}  // namespace grapnel::kernels
#endif
