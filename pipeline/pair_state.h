#pragma once

#include <cstddef>

#include "base/arena.h"
#include "pipeline/coarse/pose_score.h"
#include "pipeline/features.h"
#include "pipeline/judge/overlap.h"
#include "pipeline/limits.h"
#include "pipeline/preprocess/voxel.h"
#include "pipeline/refine/closest_point_table.h"
#include "pipeline/surface.h"
#include "pipeline/view_grid.h"

namespace grapnel {

/// A view ready for matching: thinned twice, with normals, features and a closest-point table.
struct ViewIndex {
  Surface fine;
  Surface coarse;
  ClosestPointTable table;  ///< of the fine points
  SampleSet samples;
  KeypointSet keypoints;
  FeatureMatrix features;
  bool has_normals = false;  ///< the fine points have theirs, from the camera's grid
  bool own_normals = false;  ///< the view came with normals, which say the side
  double size_m = 0.0;       ///< three times the root mean square distance from the middle
  Vec3d centre = Vec3d::Zero();

  void reserve(Arena& arena, const Limits& limits, std::size_t dimension, std::size_t max_fine,
               std::size_t max_voxels, std::size_t max_samples);
};

/// A pose of a pair after refinement, and what both views say about it.
struct PairCandidate {
  RefinedPose refined;
  OverlapEvidence forward;
  OverlapEvidence back;
  double worth = 0.0;
};

/// What a registrar of pairs owns beside its stages.
struct PairState {
  VoxelGrid voxel{VoxelParams{}};
  ViewGrid grid;  ///< of the view that is thinned
  Surface work;   ///< a view as read, thinned in place
  ViewIndex source;
  ViewIndex target;
  Hypotheses proposed;
  Hypotheses settled;
  FixedList<PairCandidate> candidates;
};

}  // namespace grapnel
