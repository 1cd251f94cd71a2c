#pragma once

#include <cstddef>
#include <span>

#include "base/geometry.h"
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

/// A pair's points, where a draw needs them together.
struct PlacedPair {
  Vec3f source = Vec3f::Zero();
  Vec3f target = Vec3f::Zero();
  std::size_t source_point = 0;
  std::size_t target_point = 0;
};
/// Of each of the pairs; `out` has room for them.
void place_pairs(const PairView& pair, const Correspondences& correspondences,
                 std::span<PlacedPair> out) noexcept;
/// The same draw from pairs that were placed: many draws from the same pairs cost less.
[[nodiscard]] bool draw_pose(const PairView& pair, std::span<const PlacedPair> placed,
                             const TripleCheck& check, Rng& rng, Pose& target_from_source) noexcept;

/// A third of the source keypoints' extent: triples wider than noise and narrower than the part.
[[nodiscard]] double extent_m(const Surface& surface, std::span<const Keypoint> keypoints) noexcept;

}  // namespace grapnel
