#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "base/field.h"
#include "pipeline/stage.h"

namespace grapnel {

struct FlyingPointParams {
  int min_support = 3;           ///< of eight neighbours, how many must lie on the same surface
  double sigma_1m_m = 0.001425;  ///< axial noise at 1 m, growing with z²
  double sigmas = 3.0;
  double max_slope_rad = 1.396;    ///< incidence beyond which a step is an edge
  double max_grazing_rad = 1.396;  ///< points with a normal seen flatter than this go too
};
[[nodiscard]] FieldTable flying_point_fields() noexcept;

/// Removes points of an organised surface that hang between two surfaces (too few of their eight
/// neighbours lie within what noise and slope explain), and those whose normal says that the camera
/// grazes the surface there.
class FlyingPoints final : public CloudFilter {
 public:
  explicit FlyingPoints(const FlyingPointParams& params) noexcept : params_(params) {}

  void reserve(Arena& arena, const Limits& limits) override;
  /// Errors: TooFewPoints, CapacityExceeded, BadParameter (no grid, not finite).
  Result<std::size_t> apply(Surface& surface) noexcept override;

 private:
  [[nodiscard]] int support(const Surface& surface, std::size_t point_i,
                            float slope_per_m) const noexcept;

  FlyingPointParams params_;
  std::span<std::uint8_t> keep_;
};

}  // namespace grapnel
