#include "pipeline/kernels/nearest.h"

#include <algorithm>
#include <array>
#include <limits>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pipeline/kernels/nearest.cpp"
#include "hwy/foreach_target.h"
#include "hwy/highway.h"

HWY_BEFORE_NAMESPACE();
namespace grapnel {
namespace kernels {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

template <class D>
struct Running {
  hn::Vec<D> best, second;
  hn::Vec<hn::RebindToSigned<D>> best_row, second_row;
};

template <class D>
HWY_INLINE void Update(D, hn::Vec<D> squared, hn::Vec<hn::RebindToSigned<D>> row, Running<D>& r) {
  const hn::RebindToSigned<D> di;
  const auto first = hn::Lt(squared, r.best);
  const auto next = hn::Lt(squared, r.second);
  const auto first_i = hn::RebindMask(di, first);
  const auto next_i = hn::RebindMask(di, next);
  r.second = hn::IfThenElse(first, r.best, hn::IfThenElse(next, squared, r.second));
  r.second_row = hn::IfThenElse(first_i, r.best_row, hn::IfThenElse(next_i, row, r.second_row));
  r.best = hn::IfThenElse(first, squared, r.best);
  r.best_row = hn::IfThenElse(first_i, row, r.best_row);
}

/// Rows `lane`… of every block against four queries. Each row's sum runs over the dimensions in
/// order, so that it does not depend on the vectors' width.
void ScanLanes(const BlockedRows& rows, const float* const* queries, std::size_t lane,
               LaneBest* out) {
  const hn::CappedTag<float, NearestRows::kBlock> d;
  const hn::RebindToSigned<decltype(d)> di;
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  Running<hn::CappedTag<float, NearestRows::kBlock>> r[kQueriesAtOnce];
  for (auto& running : r) {
    running.best = running.second = hn::Set(d, kInfinity);
    running.best_row = running.second_row = hn::Set(di, -1);
  }
  const float* q0 = queries[0];
  const float* q1 = queries[1];
  const float* q2 = queries[2];
  const float* q3 = queries[3];
  const auto step = hn::Set(di, static_cast<std::int32_t>(NearestRows::kBlock));
  auto row = hn::Iota(di, static_cast<std::int32_t>(lane));
  const float* block = rows.blocks + lane;
  for (std::size_t b = 0; b < rows.block_count; ++b) {
    const auto bias = hn::LoadU(d, rows.bias + b * NearestRows::kBlock + lane);
    auto s0 = bias;
    auto s1 = bias;
    auto s2 = bias;
    auto s3 = bias;
    for (std::size_t i = 0; i < rows.dimension; ++i, block += NearestRows::kBlock) {
      const auto values = hn::LoadU(d, block);
      const auto d0 = hn::Sub(hn::Set(d, q0[i]), values);
      const auto d1 = hn::Sub(hn::Set(d, q1[i]), values);
      const auto d2 = hn::Sub(hn::Set(d, q2[i]), values);
      const auto d3 = hn::Sub(hn::Set(d, q3[i]), values);
      s0 = hn::Add(s0, hn::Mul(d0, d0));
      s1 = hn::Add(s1, hn::Mul(d1, d1));
      s2 = hn::Add(s2, hn::Mul(d2, d2));
      s3 = hn::Add(s3, hn::Mul(d3, d3));
    }
    Update(d, s0, row, r[0]);
    Update(d, s1, row, r[1]);
    Update(d, s2, row, r[2]);
    Update(d, s3, row, r[3]);
    row = hn::Add(row, step);
  }
  for (std::size_t q = 0; q < kQueriesAtOnce; ++q) {
    hn::StoreU(r[q].best, d, out[q].best + lane);
    hn::StoreU(r[q].second, d, out[q].second + lane);
    hn::StoreU(r[q].best_row, di, out[q].best_row + lane);
    hn::StoreU(r[q].second_row, di, out[q].second_row + lane);
  }
}

void ScanBlocks(const BlockedRows& rows, const float* const* queries, LaneBest* out) {
  const hn::CappedTag<float, NearestRows::kBlock> d;
  for (std::size_t lane = 0; lane < NearestRows::kBlock; lane += hn::Lanes(d)) {
    ScanLanes(rows, queries, lane, out);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace kernels
}  // namespace grapnel
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace grapnel {
namespace kernels {

HWY_EXPORT(ScanBlocks);

namespace {

void offer(float squared, std::int32_t row, NearestTwo& found) noexcept {
  if (row < 0) return;
  const auto nearer = [&](float than, std::int32_t than_row) {
    return than_row < 0 || squared < than || (squared == than && row < than_row);
  };
  if (nearer(found.best_squared, found.best)) {
    found.second = found.best;
    found.second_squared = found.best_squared;
    found.best = row;
    found.best_squared = squared;
  } else if (nearer(found.second_squared, found.second)) {
    found.second = row;
    found.second_squared = squared;
  }
}

}  // namespace

void nearest_two(const BlockedRows& rows, const float* const* queries, std::size_t count,
                 NearestTwo* found) noexcept {
  std::array<const float*, kQueriesAtOnce> four{};
  for (std::size_t q = 0; q < kQueriesAtOnce; ++q) four[q] = queries[std::min(q, count - 1)];
  std::array<LaneBest, kQueriesAtOnce> lanes;
  HWY_DYNAMIC_DISPATCH(ScanBlocks)(rows, four.data(), lanes.data());
  for (std::size_t q = 0; q < count; ++q) {
    found[q] = NearestTwo{};
    for (std::size_t lane = 0; lane < NearestRows::kBlock; ++lane) {
      offer(lanes[q].best[lane], lanes[q].best_row[lane], found[q]);
      offer(lanes[q].second[lane], lanes[q].second_row[lane], found[q]);
    }
  }
}

}  // namespace kernels

namespace {

bool all_zero(std::span<const float> row) noexcept {
  return std::all_of(row.begin(), row.end(), [](float value) { return value == 0.0F; });
}

}  // namespace

void NearestRows::reserve(Arena& arena, std::size_t max_rows, std::size_t max_dimension) {
  const std::size_t blocks = (max_rows + kBlock - 1) / kBlock;
  blocks_ = arena.take<float>(blocks * kBlock * max_dimension);
  bias_ = arena.take<float>(blocks * kBlock);
}

void NearestRows::build(const FeatureMatrix& rows) noexcept {
  rows_ = rows.rows;
  dimension_ = rows.dimension;
  const std::size_t blocks = (rows_ + kBlock - 1) / kBlock;
  GRAPNEL_ASSERT(blocks * kBlock <= bias_.size());
  GRAPNEL_ASSERT(blocks * kBlock * dimension_ <= blocks_.size());
  for (std::size_t row = 0; row < blocks * kBlock; ++row) {
    float* to = blocks_.data() + row / kBlock * kBlock * dimension_ + row % kBlock;
    const bool findable = row < rows_ && !all_zero(rows.row(row));
    bias_[row] = findable ? 0.0F : std::numeric_limits<float>::infinity();
    for (std::size_t i = 0; i < dimension_; ++i) {
      to[i * kBlock] = findable ? rows.row(row)[i] : 0.0F;
    }
  }
}

void NearestRows::find(const FeatureMatrix& queries, std::span<NearestTwo> found) const noexcept {
  GRAPNEL_ASSERT(queries.dimension == dimension_ && found.size() >= queries.rows);
  const kernels::BlockedRows blocked{blocks_.data(), bias_.data(), (rows_ + kBlock - 1) / kBlock,
                                     dimension_};
  for (std::size_t first = 0; first < queries.rows; first += kernels::kQueriesAtOnce) {
    const std::size_t count = std::min(kernels::kQueriesAtOnce, queries.rows - first);
    std::array<const float*, kernels::kQueriesAtOnce> four{};
    for (std::size_t q = 0; q < count; ++q) four[q] = queries.row(first + q).data();
    kernels::nearest_two(blocked, four.data(), count, found.data() + first);
    for (std::size_t q = 0; q < count; ++q) {
      if (all_zero(queries.row(first + q))) found[first + q] = NearestTwo{};
    }
  }
}

}  // namespace grapnel
#endif
