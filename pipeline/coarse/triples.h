#pragma once

#include "base/rng.h"
#include "pipeline/stage.h"

namespace grapnel {

/// What makes three pairs worth a closed-form pose.
struct TripleCheck {
  double min_edge_m = 0.0;      ///< the three points lie at least this far apart
  double min_edge_ratio = 0.9;  ///< shorter over longer of two corresponding edges
  double cos_normal = 0.7;      ///< the pose turns normals to within this of their partners
};

/// Draws three pairs and, when edges and normals agree, sets the pose that carries their sources
/// onto their targets. Most draws fail, cheaply.
[[nodiscard]] bool draw_pose(const PairView& pair, const Correspondences& correspondences,
                             const TripleCheck& check, Rng& rng, Pose& target_from_source) noexcept;

/// A third of the source keypoints' extent: triples wider than noise and narrower than the part.
[[nodiscard]] double extent_m(const Surface& surface, std::span<const Keypoint> keypoints) noexcept;

}  // namespace grapnel
