#include "pipeline/kernels/within.h"

#include "pipeline/kernels/compress_table.h"

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
        // In registers and stored whole: compressing into memory takes some processors a hundred
        // cycles.
#if HWY_TARGET == HWY_AVX2 || HWY_TARGET == HWY_SSE4 || HWY_TARGET == HWY_SSSE3
      std::uint8_t bits[8] = {};
      hn::StoreMaskBits(df, inside, bits);
      const auto lane = hn::LoadU(di, kLanesOf[bits[0]].data());
      hn::StoreU(hn::TableLookupLanes(here, hn::IndicesFromVec(di, lane)), di, position + found);
      hn::StoreU(hn::TableLookupLanes(squared, hn::IndicesFromVec(df, lane)), df,
                 squared_m2 + found);
#else
      hn::StoreU(hn::Compress(here, hn::RebindMask(di, inside)), di, position + found);
      hn::StoreU(hn::Compress(squared, inside), df, squared_m2 + found);
#endif
      found += hn::CountTrue(df, inside);
    }
  }
  return found;
}

/// Lanes kLane… of the eight partial sums of every moment.
void MomentLanes(const PointPlanes& points, std::span<const PointRange> ranges,
                 const Sphere& sphere, std::int32_t lane, PartialMoments& out) {
  const hn::CappedTag<float, kPartials> df;
  using V = hn::Vec<decltype(df)>;
  const hn::RebindToSigned<decltype(df)> di;
  const V cx = hn::Set(df, sphere.x);
  const V cy = hn::Set(df, sphere.y);
  const V cz = hn::Set(df, sphere.z);
  const V limit = hn::Set(df, sphere.squared_m2);
  const V one = hn::Set(df, 1.0F);
  const auto count_up = hn::Iota(di, lane);
  V count = hn::LoadU(df, out.sum[0] + lane);
  V x = hn::LoadU(df, out.sum[1] + lane);
  V y = hn::LoadU(df, out.sum[2] + lane);
  V z = hn::LoadU(df, out.sum[3] + lane);
  V xx = hn::LoadU(df, out.sum[4] + lane);
  V xy = hn::LoadU(df, out.sum[5] + lane);
  V xz = hn::LoadU(df, out.sum[6] + lane);
  V yy = hn::LoadU(df, out.sum[7] + lane);
  V yz = hn::LoadU(df, out.sum[8] + lane);
  V zz = hn::LoadU(df, out.sum[9] + lane);
  for (const PointRange& range : ranges) {
    for (std::int32_t i = range.begin; i < range.end; i += kPartials) {
      const V dx = hn::Sub(hn::LoadU(df, points.x + i + lane), cx);
      const V dy = hn::Sub(hn::LoadU(df, points.y + i + lane), cy);
      const V dz = hn::Sub(hn::LoadU(df, points.z + i + lane), cz);
      const V px = hn::Mul(dx, dx);
      const V py = hn::Mul(dy, dy);
      const V pz = hn::Mul(dz, dz);
      const V squared = hn::Add(hn::Add(px, py), pz);
      const auto here = hn::Add(hn::Set(di, i), count_up);
      const auto in_range = hn::RebindMask(df, hn::Lt(here, hn::Set(di, range.end)));
      const auto inside = hn::And(in_range, hn::Le(squared, limit));
      if (hn::AllFalse(df, inside)) continue;
      const V kx = hn::IfThenElseZero(inside, dx);
      const V ky = hn::IfThenElseZero(inside, dy);
      const V kz = hn::IfThenElseZero(inside, dz);
      count = hn::Add(count, hn::IfThenElseZero(inside, one));
      x = hn::Add(x, kx);
      y = hn::Add(y, ky);
      z = hn::Add(z, kz);
      xx = hn::Add(xx, hn::IfThenElseZero(inside, px));
      xy = hn::Add(xy, hn::Mul(kx, dy));
      xz = hn::Add(xz, hn::Mul(kx, dz));
      yy = hn::Add(yy, hn::IfThenElseZero(inside, py));
      yz = hn::Add(yz, hn::Mul(ky, dz));
      zz = hn::Add(zz, hn::IfThenElseZero(inside, pz));
    }
  }
  const V sums[kMoments] = {count, x, y, z, xx, xy, xz, yy, yz, zz};
  for (int i = 0; i < kMoments; ++i) hn::StoreU(sums[i], df, out.sum[i] + lane);
}

void AddMoments(const PointPlanes& points, std::span<const PointRange> ranges, const Sphere& sphere,
                PartialMoments& out) {
  const hn::CappedTag<float, kPartials> df;
  for (std::int32_t lane = 0; lane < kPartials; lane += static_cast<std::int32_t>(hn::Lanes(df))) {
    MomentLanes(points, ranges, sphere, lane, out);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace kernels
}  // namespace grapnel
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace grapnel::kernels {

HWY_EXPORT(SelectWithin);
HWY_EXPORT(AddMoments);

SphereMoments fold(const PartialMoments& partial) noexcept {
  float total[kMoments];
  for (int i = 0; i < kMoments; ++i) {
    const float* s = partial.sum[i];
    total[i] = ((s[0] + s[4]) + (s[2] + s[6])) + ((s[1] + s[5]) + (s[3] + s[7]));
  }
  return {total[0], total[1], total[2], total[3], total[4],
          total[5], total[6], total[7], total[8], total[9]};
}

void add_sphere_moments(const PointPlanes& points, std::span<const PointRange> ranges,
                        const Sphere& sphere, PartialMoments& partial) noexcept {
  HWY_DYNAMIC_DISPATCH(AddMoments)(points, ranges, sphere, partial);
}

std::size_t select_within(const PointPlanes& points, std::span<const PointRange> ranges,
                          const Sphere& sphere, std::int32_t* position,
                          float* squared_m2) noexcept {
  return HWY_DYNAMIC_DISPATCH(SelectWithin)(points, ranges, sphere, position, squared_m2);
}

}  // namespace grapnel::kernels
#endif
