#pragma once

#include <cstdint>

#include "base/field.h"
#include "base/geometry.h"
#include "pipeline/kernels/depth_rows.h"

namespace grapnel {

/// What the sensor's noise and the steepest visible surface allow as a step between two
/// neighbouring pixels.
struct DepthGapParams {
  /// Axial noise at 1 m, growing with z²: Khoshelham & Elberink 2012, Kinect v1.
  double sigma_1m_m = 0.001425;
  double sigmas = 3.0;
  double max_slope_rad = 1.396;  ///< angle of incidence beyond which a step is an edge: 80 degrees
};

[[nodiscard]] FieldTable depth_gap_fields() noexcept;

/// The largest step in counts between neighbours of one surface, as a function of depth.
class DepthGap {
 public:
  DepthGap(const DepthGapParams& params, const Intrinsics& intrinsics,
           double metres_per_unit) noexcept;

  /// At least one count: the sensor's own quantisation.
  [[nodiscard]] std::int32_t counts(std::uint16_t depth) const noexcept {
    const auto d = static_cast<float>(depth);
    return 1 + static_cast<std::int32_t>(d * (law_.linear + law_.quadratic * d));
  }
  [[nodiscard]] const kernels::GapLaw& law() const noexcept { return law_; }
  [[nodiscard]] bool continuous(std::uint16_t a, std::uint16_t b) const noexcept {
    const std::int32_t step = a > b ? a - b : b - a;
    return step <= counts(a < b ? a : b);
  }

 private:
  kernels::GapLaw law_;  ///< linear: slope over one pixel; quadratic: noise
};

}  // namespace grapnel
