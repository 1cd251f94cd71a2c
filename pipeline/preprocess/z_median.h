#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "base/field.h"
#include "pipeline/stage.h"

namespace grapnel {

struct ZMedianParams {
  int window = 5;               ///< pixels, odd
  double max_movement_m = 1e6;  ///< a depth changes by at most this
  bool keep_rays = true;        ///< x and y follow, so that points stay on their rays; PCL: false
};
[[nodiscard]] FieldTable z_median_fields() noexcept;

/// Gives each point of an organised surface the median depth of the points in its window, the upper
/// one of an even count (as PCL's MedianFilter, which moves z alone: keep_rays = false).
class ZMedian final : public CloudFilter {
 public:
  explicit ZMedian(const ZMedianParams& params) noexcept : params_(params) {}

  void reserve(Arena& arena, const Limits& limits) override;
  /// Removes nothing. Errors: TooFewPoints, CapacityExceeded, BadParameter (no grid, not finite).
  Result<std::size_t> apply(Surface& surface) noexcept override;

 private:
  ZMedianParams params_;
  std::span<float> z_;
};

}  // namespace grapnel
