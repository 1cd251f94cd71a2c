#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "base/field.h"
#include "pipeline/stage.h"

namespace grapnel {

struct GridStrideParams {
  int stride = 2;  ///< pixels of a block's side
};
[[nodiscard]] FieldTable grid_stride_fields() noexcept;

/// Leaves one point of each block of pixels of an organised surface: that of the median depth, the
/// upper one of an even count. The surface keeps a grid, of the blocks; spacing_m grows.
class GridStride final : public CloudFilter {
 public:
  explicit GridStride(const GridStrideParams& params) noexcept : params_(params) {}

  void reserve(Arena& arena, const Limits& limits) override;
  /// Errors: TooFewPoints, CapacityExceeded, BadParameter (no grid, not finite).
  Result<std::size_t> apply(Surface& surface) noexcept override;

 private:
  GridStrideParams params_;
  std::span<std::int32_t> chosen_;
  std::span<float> plane_;
};

}  // namespace grapnel
