#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "base/field.h"
#include "pipeline/neighbours/neighbour_search.h"
#include "pipeline/stage.h"

namespace grapnel {

struct RadiusOutlierParams {
  double radius_m = 0.0;  ///< 0 = auto: radius_ratio spacings
  double radius_ratio = 3.0;
  int min_neighbours = 5;  ///< other points within the radius; fewer: removed
};
[[nodiscard]] FieldTable radius_outlier_fields() noexcept;

/// Removes points with too few others within a radius (as PCL's RadiusOutlierRemoval).
class RadiusOutliers final : public CloudFilter {
 public:
  explicit RadiusOutliers(const RadiusOutlierParams& params) noexcept : params_(params) {}

  /// Room for clouds of the limits' max_input_points.
  void reserve(Arena& arena, const Limits& limits) override;
  /// Errors: TooFewPoints, CapacityExceeded, BadParameter (no radius, not finite).
  Result<std::size_t> apply(Surface& surface) noexcept override;

 private:
  RadiusOutlierParams params_;
  NeighbourSearch search_;
  std::span<std::uint8_t> keep_;
};

}  // namespace grapnel
