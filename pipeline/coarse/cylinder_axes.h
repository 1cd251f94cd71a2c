#pragma once

#include <cstddef>

#include "base/field.h"
#include "pipeline/coarse/cylinder_fit.h"
#include "pipeline/coarse/pose_finalists.h"
#include "pipeline/stage.h"

namespace grapnel {

struct CylinderAxesParams {
  std::size_t trials = 200;           ///< pairs of points tried
  double thickness_ratio = 0.6;       ///< half thickness of the wall, spacings
  double max_normal_angle_rad = 0.4;  ///< of a point's normal from the radius through it
  double min_share = 0.05;            ///< of all points, on the wall: little of one standing
  double max_radius_error = 0.25;     ///< share by which the radii may differ
  std::size_t turns = 8;              ///< about the axis; 1 for a part that is free about it
  std::size_t ratings = 3000;         ///< poses looked at, at most
  std::size_t quick_samples = 48;     ///< of a first rating
};
[[nodiscard]] FieldTable cylinder_axes_fields() noexcept;

/// Poses from the cylinder in both surfaces, for barrels, rolls and bottles: axis onto axis, either
/// way round, with one end, the other end or the middle of both together, and some turns about it.
/// Needs the view's score; correspondences are not looked at.
class CylinderAxes final : public HypothesisGenerator {
 public:
  explicit CylinderAxes(const CylinderAxesParams& params) : params_(params) {}

  void reserve(Arena& arena, const Limits&) override { finalists_.reserve(arena); }
  [[nodiscard]] bool supports_by_score() const noexcept override { return true; }
  [[nodiscard]] bool needs_correspondences() const noexcept override { return false; }
  Status generate(const PairView& pair, const Correspondences& correspondences, Rng& rng,
                  Hypotheses& hypotheses) noexcept override;

 private:
  void try_axes(const Cylinder& source, const Cylinder& target) noexcept;

  CylinderAxesParams params_;
  PoseFinalists finalists_;
};

}  // namespace grapnel
