#include "pipeline/kernels/weighted_rows.h"

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
  const std::size_t lanes = hn::Lanes(d);
  for (std::size_t i = 0; i < targets.size(); ++i) {
    float* to = matrix + static_cast<std::size_t>(targets[i]) * stride;
    const auto weight = hn::Set(d, weights[i]);
    for (std::size_t k = 0; k < kWeightedLength; k += lanes) {
      const auto sum = hn::Add(hn::LoadU(d, to + k), hn::Mul(weight, hn::LoadU(d, row + k)));
      hn::StoreU(sum, d, to + k);
    }
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace kernels
}  // namespace grapnel
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace grapnel::kernels {

HWY_EXPORT(AddWeightedRow);

void add_weighted_row(const float* row, std::span<const std::int32_t> targets, const float* weights,
                      std::size_t stride, float* matrix) noexcept {
  HWY_DYNAMIC_DISPATCH(AddWeightedRow)(row, targets, weights, stride, matrix);
}

}  // namespace grapnel::kernels
#endif
