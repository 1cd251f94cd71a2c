#pragma once

#include <cstddef>

#include "base/error.h"
#include "pipeline/features.h"
#include "pipeline/judge/depth_view.h"
#include "pipeline/judge/model_render.h"
#include "pipeline/refine/closest_point_table.h"
#include "pipeline/surface.h"

namespace grapnel {

struct ContourFitParams {
  int iterations = 8;
  int render_every = 2;             ///< iterations between two predictions of the outline
  std::size_t max_points = 1000;    ///< of the object
  double contour_weight = 0.3;      ///< of the outline against the surface; 0 = surface only
  double max_distance_ratio = 1.0;  ///< × model spacing: partners of the surface
  double start_reach_ratio = 0.06;  ///< × model diameter: outline partners at first
  double end_reach_ratio = 0.015;   ///< and at last
};
[[nodiscard]] FieldTable contour_fit_fields() noexcept;

/// Joint fit of a model's surface and outline to a view. What a flat face leaves open (sliding and
/// turning in its plane) the outline fixes: predicted outline points are drawn toward the nearest
/// depth edge, along the outline's normal (as Harris and Stennett 1990 track edges), while the
/// object's points are drawn onto the model's surface.
class ContourFit {
 public:
  explicit ContourFit(const ContourFitParams& params) : params_(params) {}

  /// `render` is scratch. Errors: RefinementDiverged.
  Result<RefinedPose> refine(const Surface& object, const Surface& model,
                             const ClosestPointTable& table, const DepthView& view,
                             const EdgeMap& edges, const Pose& camera_from_model, double diameter_m,
                             ModelRender& render) noexcept;

 private:
  ContourFitParams params_;
};

}  // namespace grapnel
