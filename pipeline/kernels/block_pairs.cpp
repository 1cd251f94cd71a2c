#include "pipeline/kernels/block_pairs.h"

#include <algorithm>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pipeline/kernels/block_pairs.cpp"
#include "hwy/foreach_target.h"
#include "hwy/highway.h"
#include "pipeline/kernels/block_centres-inl.h"
#include "pipeline/kernels/pair_bins-inl.h"

HWY_BEFORE_NAMESPACE();
namespace grapnel {
namespace kernels {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Whole = hn::RebindToSigned<Lanes>;
constexpr std::size_t kLanes = hn::MaxLanes(Lanes());
constexpr std::size_t kVectors = kBlock / kLanes;

bool AddNearBlock(const PointPlanes& points, const BlockOfPoints& block,
                  std::span<const PointRange> ranges, float squared_m2, NearBlock& near) {
  const Lanes d;
  const Whole di;
  const V limit = Number(squared_m2);
  const V outside = Number(kOutside);
  Centres centres[kVectors];
  hn::Vec<Whole> of[kVectors];
  for (std::size_t k = 0; k < kVectors; ++k) {
    centres[k] = CentresOf(points, block, static_cast<std::int32_t>(k * kLanes));
    of[k] = hn::LoadU(di, near.of.data() + k * kLanes);
  }
  std::size_t found = near.size;
  std::int32_t* const position = near.position.data();
  float* const squared = near.squared_m2.data();
  for (const PointRange& range : ranges) {
    if (found + static_cast<std::size_t>(range.end - range.begin) > near.position.size()) {
      return false;
    }
    for (std::int32_t i = range.begin; i < range.end; ++i) {
      // Stored whether or not it is near; what is not, the next one overwrites.
      position[found] = i;
      bool any = false;
      for (std::size_t k = 0; k < kVectors; ++k) {
        const V to = OffsetsOf(points, i, centres[k]).squared;
        const auto inside = hn::Le(to, limit);
        hn::StoreU(hn::IfThenElse(inside, to, outside), d, squared + found * kBlock + k * kLanes);
        of[k] = hn::Sub(of[k], hn::VecFromMask(di, hn::RebindMask(di, inside)));
        any = any || !hn::AllFalse(d, inside);
      }
      found += any ? 1U : 0U;
    }
  }
  for (std::size_t k = 0; k < kVectors; ++k) hn::StoreU(of[k], di, near.of.data() + k * kLanes);
  near.size = found;
  return true;
}

#if HWY_TARGET != HWY_SCALAR
using Bytes = hn::Repartition<std::uint8_t, Lanes>;
using Words = hn::Repartition<std::uint32_t, Lanes>;

/// How many of the vectors' bytes, every kBlock * kVectors entries one, hold each bin; at most 255
/// vectors.
HWY_INLINE void CountBytes(const std::int32_t* bins, std::size_t vectors, std::size_t step,
                           hn::Vec<Bytes> (&counts)[kPairBins]) {
  const Bytes d8;
  const Whole di;
  for (auto& count : counts) count = hn::Zero(d8);
  for (std::size_t i = 0; i < vectors; ++i) {
    const auto packed = hn::BitCast(d8, hn::LoadU(di, bins + i * step));
    for (int b = 0; b < kPairBins; ++b) {
      const auto same = hn::Eq(packed, hn::Set(d8, static_cast<std::uint8_t>(b)));
      counts[b] = hn::Sub(counts[b], hn::VecFromMask(d8, same));
    }
  }
}
#endif

/// Adds a number's three bytes to a bin's counts of the three features.
HWY_INLINE void AddBytes(std::uint32_t bytes, std::size_t bin, PairBinCounts& counts) {
  for (std::size_t feature = 0; feature < 3; ++feature) {
    counts[feature * kPairBins + bin] += bytes >> (8 * feature) & 0xff;
  }
}

void CountBins(const std::int32_t* bins, std::size_t count, PairBinCounts& counts) {
#if HWY_TARGET == HWY_SCALAR
  for (std::size_t i = 0; i < count; ++i) {
    if (bins[i] == kNoPair) continue;
    for (std::size_t feature = 0; feature < 3; ++feature) {
      ++counts[feature * kPairBins + (static_cast<std::uint32_t>(bins[i]) >> (8 * feature) & 0xff)];
    }
  }
#else
  // So few that even the sum over the lanes is a byte.
  constexpr std::size_t kMost = 255 / kLanes;
  const Words dw;
  hn::Vec<Bytes> counted[kPairBins];
  const std::size_t vectors = (count + kLanes - 1) / kLanes;
  for (std::size_t first = 0; first < vectors; first += kMost) {
    CountBytes(bins + first * kLanes, std::min(kMost, vectors - first), kLanes, counted);
    for (std::size_t b = 0; b < kPairBins; ++b) {
      AddBytes(hn::GetLane(hn::SumOfLanes(dw, hn::BitCast(dw, counted[b]))), b, counts);
    }
  }
#endif
}

void CountBlockPairs(const float* points, const BlockOfPoints& block, const NearBlock& near,
                     std::int32_t* bins, std::array<PairBinCounts, kBlock>& counts) {
  const Lanes d;
  const Whole di;
  for (PairBinCounts& own : counts) own.fill(0);
  std::array<std::int32_t, kBlock> own;
  for (std::int32_t lane = 0; lane < kBlock; ++lane) {
    own[static_cast<std::size_t>(lane)] = block.first + std::min(lane, block.count - 1);
  }
  const auto none = hn::Set(di, kNoPair);
  for (std::size_t lane = 0; lane < kBlock; lane += kLanes) {
    const auto p = LoadPoints(d, points, own.data() + lane);
    for (std::size_t i = 0; i < near.size; ++i) {
      const float* q = points + static_cast<std::size_t>(near.position[i]) * kOrientedRow;
      const Vector3<V> place{Number(q[0]), Number(q[1]), Number(q[2])};
      const Vector3<V> normal{Number(q[3]), Number(q[4]), Number(q[5])};
      const auto found =
          BinsOfPairs(d, p.place, p.normal, place, normal, static_cast<float>(kPairBins));
      const V squared = hn::LoadU(d, near.squared_m2.data() + i * kBlock + lane);
      const auto outside = hn::RebindMask(di, hn::Lt(squared, hn::Zero(d)));
      hn::StoreU(hn::IfThenElse(outside, none, Packed(d, found)), di, bins + i * kBlock + lane);
    }
  }
#if HWY_TARGET == HWY_SCALAR
  for (std::size_t lane = 0; lane < kBlock; ++lane) {
    for (std::size_t i = 0; i < near.size; ++i)
      CountBins(bins + i * kBlock + lane, 1, counts[lane]);
  }
#else
  constexpr std::size_t kMost = 255;
  const Words dw;
  hn::Vec<Bytes> counted[kPairBins];
  for (std::size_t lane = 0; lane < kBlock; lane += kLanes) {
    for (std::size_t first = 0; first < near.size; first += kMost) {
      CountBytes(bins + first * kBlock + lane, std::min(kMost, near.size - first), kBlock, counted);
      for (std::size_t b = 0; b < kPairBins; ++b) {
        std::uint32_t bytes[kLanes];
        hn::StoreU(hn::BitCast(dw, counted[b]), dw, bytes);
        for (std::size_t k = 0; k < kLanes; ++k) AddBytes(bytes[k], b, counts[lane + k]);
      }
    }
  }
#endif
}

void AddBlockRows(const BlockRows& rows, const NearBlock& near, const std::int32_t* row_at,
                  std::size_t stride, float* HWY_RESTRICT matrix) {
  const Lanes d;
  const V zero = hn::Zero(d);
  const V one = Number(1.0F);
  constexpr std::size_t kParts = kWeightedLength / kLanes;
  HWY_ALIGN float weight[kBlock];
  for (std::size_t i = 0; i < near.size; ++i) {
    const std::int32_t row = row_at[near.position[i]];
    if (row < 0) continue;
    for (std::size_t lane = 0; lane < kBlock; lane += kLanes) {
      const V squared = hn::LoadU(d, near.squared_m2.data() + i * kBlock + lane);
      const auto near_it = hn::Gt(squared, zero);
      hn::Store(hn::IfThenElseZero(near_it, hn::Div(one, squared)), d, weight + lane);
    }
    float* const to = matrix + static_cast<std::size_t>(row) * stride;
    V sum[kParts];
    for (std::size_t k = 0; k < kParts; ++k) sum[k] = hn::LoadU(d, to + k * kLanes);
    for (std::size_t lane = 0; lane < kBlock; ++lane) {
      const V share = Number(weight[lane]);
      for (std::size_t k = 0; k < kParts; ++k) {
        sum[k] = hn::Add(sum[k], hn::Mul(share, hn::LoadU(d, rows[lane].data() + k * kLanes)));
      }
    }
    for (std::size_t k = 0; k < kParts; ++k) hn::StoreU(sum[k], d, to + k * kLanes);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace kernels
}  // namespace grapnel
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace grapnel::kernels {

HWY_EXPORT(AddNearBlock);
HWY_EXPORT(CountBins);
HWY_EXPORT(CountBlockPairs);
HWY_EXPORT(AddBlockRows);

bool add_near_block(const PointPlanes& points, const BlockOfPoints& block,
                    std::span<const PointRange> ranges, float squared_m2,
                    NearBlock& near) noexcept {
  return HWY_DYNAMIC_DISPATCH(AddNearBlock)(points, block, ranges, squared_m2, near);
}

void count_bins(const std::int32_t* bins, std::size_t count, PairBinCounts& counts) noexcept {
  HWY_DYNAMIC_DISPATCH(CountBins)(bins, count, counts);
}

void count_block_pairs(const float* points, const BlockOfPoints& block, const NearBlock& near,
                       std::span<std::int32_t> bins,
                       std::array<PairBinCounts, kBlock>& counts) noexcept {
  HWY_DYNAMIC_DISPATCH(CountBlockPairs)(points, block, near, bins.data(), counts);
}

void add_block_rows(const BlockRows& rows, const NearBlock& near, const std::int32_t* row_at,
                    std::size_t stride, float* matrix) noexcept {
  HWY_DYNAMIC_DISPATCH(AddBlockRows)(rows, near, row_at, stride, matrix);
}

}  // namespace grapnel::kernels
#endif
