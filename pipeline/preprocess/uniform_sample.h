#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "base/field.h"
#include "pipeline/neighbours/cell_order.h"
#include "pipeline/stage.h"

namespace grapnel {

struct UniformSampleParams {
  double cell_m = 0.0;  ///< edge of a cell; 0 = auto: cell_ratio spacings
  double cell_ratio = 3.0;
};
[[nodiscard]] FieldTable uniform_sample_fields() noexcept;

/// Leaves of each cubic cell the point nearest to the cell's centre (as PCL's UniformSampling), in
/// the points' order: no new points, and a grid stays.
class UniformSample final : public CloudFilter {
 public:
  explicit UniformSample(const UniformSampleParams& params) noexcept : params_(params) {}

  /// Room for clouds of the limits' max_input_points.
  void reserve(Arena& arena, const Limits& limits) override;
  /// Errors: TooFewPoints, CapacityExceeded, BadParameter (no cell, too many cells, not finite).
  Result<std::size_t> apply(Surface& surface) noexcept override;

 private:
  UniformSampleParams params_;
  CellOrder cells_;
  std::span<std::uint32_t> best_;  // point of each cell
  std::span<std::uint8_t> keep_;
};

}  // namespace grapnel
