#pragma once

#include "base/geometry.h"
#include "pipeline/judge/depth_view.h"
#include "pipeline/judge/model_render.h"
#include "pipeline/stage.h"
#include "pipeline/surface.h"

namespace grapnel {

/// Whether a pixel belongs to what a pose leaves over: the object's own surface clearly beside the
/// predicted picture, and surface that is no part of the belt nor of another thing, but lies within
/// `reach_m` of the model: a step in depth has cut it off from the object.
class LeftOver {
 public:
  /// `gap_m`: no place on the model's surface is farther from the nearest of its points.
  LeftOver(const ClosestSurface& model, float gap_m, const Pose& camera_from_model,
           const ModelRender& render, const DepthView& view, float reach_m) noexcept;

  [[nodiscard]] bool operator()(int u, int v) const noexcept;

 private:
  [[nodiscard]] bool near_picture(int u, int v) const noexcept;

  const ClosestSurface& model_;
  const ModelRender& render_;
  const DepthView& view_;
  Eigen::Matrix3f rotation_;  ///< model from camera
  Vec3f shift_;
  float gap_m_;
  float reach_m_;
};

}  // namespace grapnel
