#pragma once

#include <cstdint>
#include <span>

#include "base/field.h"
#include "pipeline/neighbours/neighbour_search.h"
#include "pipeline/stage.h"

namespace grapnel {

struct BorderPointsParams {
  enum class Keep : std::uint8_t { Inner, Border };
  Keep keep = Keep::Inner;
  double radius_m = 0.0;  ///< neighbours; 0 = auto: radius_ratio spacings
  double radius_ratio = 3.0;
  double angle_rad =
      1.5707963267948966;  ///< gap between neighbours that makes a border: π/2, PCL's
  int min_neighbours = 3;  ///< the point included; fewer make no border (PCL: 3)
};
[[nodiscard]] FieldTable border_points_fields() noexcept;

/// Leaves what does not lie at a border of the surface, or only what does: a point of a border has
/// a wide angle about its normal without neighbours (PCL's BoundaryEstimation). Normals and
/// descriptors at a border tell more of where the view ended than of the part. A point without a
/// normal is no border. O(n · neighbours).
class BorderPoints final : public CloudFilter {
 public:
  explicit BorderPoints(const BorderPointsParams& params) noexcept : params_(params) {}

  void reserve(Arena& arena, const Limits& limits) override;
  /// Errors: TooFewPoints, CapacityExceeded, BadParameter (not finite, no radius).
  Result<std::size_t> apply(Surface& surface) noexcept override;
  /// Which points lie at a border, 1 or 0, without changing the surface; the same errors. Valid
  /// until the next call.
  [[nodiscard]] Result<std::span<const std::uint8_t>> find(const Surface& surface) noexcept;

 private:
  BorderPointsParams params_;
  NeighbourSearch search_;
  std::span<std::uint8_t> flags_;
  std::span<float> angles_;
};

}  // namespace grapnel
