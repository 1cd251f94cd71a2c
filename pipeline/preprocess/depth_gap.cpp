#include "pipeline/preprocess/depth_gap.h"

#include <array>
#include <cmath>

#include "base/math.h"

namespace grapnel {

FieldTable depth_gap_fields() noexcept {
  static constexpr std::array kFields = {
      number_field<&DepthGapParams::sigma_1m_m>("sigma_1m_m", "m", 0.0, 0.1,
                                                "axial noise at 1 m, 1 sigma; grows with z²"),
      number_field<&DepthGapParams::sigmas>("sigmas", "", 0.0, 20.0,
                                            "noise allowed in a depth step"),
      number_field<&DepthGapParams::max_slope_rad>("max_slope_rad", "rad", 0.0, 1.55,
                                                   "steepest surface; a larger step is an edge"),
  };
  return kFields;
}

DepthGap::DepthGap(const DepthGapParams& params, const Intrinsics& intrinsics,
                   double metres_per_unit) noexcept {
  const double slope = math::sin(params.max_slope_rad) / math::cos(params.max_slope_rad);
  law_.linear = static_cast<float>(slope / std::sqrt(intrinsics.fx * intrinsics.fy));
  law_.quadratic = static_cast<float>(params.sigmas * params.sigma_1m_m * metres_per_unit);
}

}  // namespace grapnel
