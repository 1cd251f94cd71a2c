#include "pipeline/kernels/weighted_rows.h"

#include "pipeline/kernels/compress_table.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pipeline/kernels/weighted_rows.cpp"
#include "hwy/foreach_target.h"
#include "hwy/highway.h"

HWY_BEFORE_NAMESPACE();
namespace grapnel {
namespace kernels {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

void AddWeightedRow(const float* HWY_RESTRICT row, std::span<const std::int32_t> targets,
                    const float* HWY_RESTRICT weights, std::size_t stride,
                    float* HWY_RESTRICT matrix) {
  const hn::CappedTag<float, 8> d;
  constexpr std::size_t kLanes = hn::MaxLanes(d);
  constexpr std::size_t kVectors = kWeightedLength / kLanes;
  hn::Vec<decltype(d)> own[kVectors];
  for (std::size_t k = 0; k < kVectors; ++k) own[k] = hn::LoadU(d, row + k * kLanes);
  for (std::size_t i = 0; i < targets.size(); ++i) {
    float* to = matrix + static_cast<std::size_t>(targets[i]) * stride;
    const auto weight = hn::Set(d, weights[i]);
    for (std::size_t k = 0; k < kVectors; ++k) {
      const auto sum = hn::Add(hn::LoadU(d, to + k * kLanes), hn::Mul(weight, own[k]));
      hn::StoreU(sum, d, to + k * kLanes);
    }
  }
}

std::size_t SelectRows(std::span<const std::int32_t> position, const float* squared_m2,
                       const std::int32_t* row_at, std::int32_t* HWY_RESTRICT rows,
                       float* HWY_RESTRICT weights) {
  const hn::CappedTag<float, 8> df;
  const hn::RebindToSigned<decltype(df)> di;
  const std::size_t lanes = hn::Lanes(df);
  const auto one = hn::Set(df, 1.0F);
  std::size_t found = 0;
  for (std::size_t i = 0; i < position.size(); i += lanes) {
    const auto there = hn::FirstN(di, position.size() - i);
    const auto at = hn::MaskedLoad(there, di, position.data() + i);
    const auto row = hn::GatherIndex(di, row_at, at);
    const auto has_row = hn::And(there, hn::Gt(row, hn::Set(di, -1)));
    if (hn::AllFalse(di, has_row)) continue;
    const auto squared = hn::MaskedLoad(hn::RebindMask(df, has_row), df, squared_m2 + i);
    const auto chosen = hn::Gt(squared, hn::Zero(df));
    const auto weight = hn::Div(one, squared);
#if HWY_TARGET == HWY_AVX2 || HWY_TARGET == HWY_SSE4 || HWY_TARGET == HWY_SSSE3
    std::uint8_t bits[8] = {};
    hn::StoreMaskBits(df, chosen, bits);
    const auto lane = hn::LoadU(di, kLanesOf[bits[0]].data());
    hn::StoreU(hn::TableLookupLanes(row, hn::IndicesFromVec(di, lane)), di, rows + found);
    hn::StoreU(hn::TableLookupLanes(weight, hn::IndicesFromVec(df, lane)), df, weights + found);
#else
    hn::StoreU(hn::Compress(row, hn::RebindMask(di, chosen)), di, rows + found);
    hn::StoreU(hn::Compress(weight, chosen), df, weights + found);
#endif
    found += hn::CountTrue(df, chosen);
  }
  return found;
}

}  // namespace HWY_NAMESPACE
}  // namespace kernels
}  // namespace grapnel
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace grapnel::kernels {

HWY_EXPORT(AddWeightedRow);
HWY_EXPORT(SelectRows);

void add_weighted_row(const float* row, std::span<const std::int32_t> targets, const float* weights,
                      std::size_t stride, float* matrix) noexcept {
  HWY_DYNAMIC_DISPATCH(AddWeightedRow)(row, targets, weights, stride, matrix);
}

std::size_t select_rows(std::span<const std::int32_t> position, const float* squared_m2,
                        const std::int32_t* row_at, std::int32_t* rows, float* weights) noexcept {
  return HWY_DYNAMIC_DISPATCH(SelectRows)(position, squared_m2, row_at, rows, weights);
}

}  // namespace grapnel::kernels
#endif
