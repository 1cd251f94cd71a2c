#pragma once

#include <span>

#include "base/field.h"
#include "pipeline/stage.h"

namespace grapnel {

struct PlaneNormalsParams {
  double max_step_ratio =
      0.05;  ///< span of the depths in a window, over their mean, that is a step
};
[[nodiscard]] FieldTable plane_normals_fields() noexcept;

/// Normals of an organised surface, whole frames in about a millisecond: the plane through the
/// inverse depths of the 5 × 5 pixels around each, which is exact for planes. Toward the camera. No
/// normal (all zero) where a pixel of the window has no reading, lies beyond the image or beyond a
/// step.
class PlaneNormals final : public NormalEstimator {
 public:
  explicit PlaneNormals(const PlaneNormalsParams& params) noexcept : params_(params) {}

  void reserve(Arena& arena, const Limits& limits) override;
  /// Errors: TooFewPoints, CapacityExceeded, BadParameter (no grid, a depth that is not positive).
  Status estimate(Surface& surface) noexcept override;

 private:
  PlaneNormalsParams params_;
  std::span<float> inverse_m_;
  std::span<float> nx_, ny_, nz_;  // of one row
};

}  // namespace grapnel
