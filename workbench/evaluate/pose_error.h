#pragma once

#include <span>
#include <vector>

#include "base/geometry.h"
#include "pipeline/model.h"

namespace grapnel {

/// How far a found pose is from the true one.
struct PoseError {
  double mean_displacement_m = 0.0;  ///< of the source's points
  double rotation_rad = 0.0;
  Pose nearest_truth = Pose::Identity();  ///< of the equivalent true poses the one compared with
};

/// The motions of a source onto itself under `symmetry`, about the axes through its own origin. A
/// free rotation is represented by the one that brings `target_from_source` nearest in rotation to
/// `found`.
[[nodiscard]] std::vector<Pose> symmetry_motions(Symmetry symmetry, const Pose& found,
                                                 const Pose& target_from_source);

/// Error of `found` against `truth` modulo `symmetry`: the equivalent true pose with the least mean
/// displacement counts. Written apart from the pipeline's own symmetry code, so that a fault there
/// shows here. O(points).
[[nodiscard]] PoseError pose_error(const Pose& found, const Pose& truth, Symmetry symmetry,
                                   std::span<const Vec3f> source_points);

}  // namespace grapnel
