#pragma once

#include <cstddef>
#include <vector>

#include "base/geometry.h"
#include "workbench/teach/frame_points.h"

namespace grapnel {

/// One camera's view in a joint fit: the points that can be relied on, and its pose.
struct JointView {
  std::vector<SurfaceSample> samples;
  Intrinsics intrinsics;
  Pose world_from_view = Pose::Identity();
};

struct JointFitOptions {
  double gate_m = 0.004;       ///< partners beyond it, along the normal, do not count
  bool fit_focal = true;       ///< also one factor on the focal lengths that all views share
  std::size_t samples = 1500;  ///< of each view that look for partners in every other view
};

/// What all views together say.
struct JointFit {
  std::vector<Pose> world_from_view;
  /// The views fit best with focal lengths times this. 1 unless it differs by more than three of
  /// its own sigmas.
  double focal_factor = 1.0;
  double focal_sigma = 0.0;
  double rms_m = 0.0;  ///< point-to-plane, of all partners
  std::size_t partners = 0;
};

/// Moves all views at once, the first one stays, so that every view's surface lies on every other's
/// where they overlap (point-to-plane, partners by projection). Needs a start that is right to
/// within the gate. A wrong focal length bends what is joined of views from around an object: seen
/// at an angle, a surface seems turned by too much or too little, which no pair shows and all pairs
/// together do. O(views² × samples).
[[nodiscard]] JointFit fit_together(const std::vector<JointView>& views,
                                    const JointFitOptions& options);

/// The samples as a camera with focal lengths times `focal_factor` would have measured them.
void apply_focal_factor(double focal_factor, std::vector<SurfaceSample>& samples);

}  // namespace grapnel
