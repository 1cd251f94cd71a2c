#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "base/geometry.h"

namespace grapnel {

/// One measured motion between two views.
struct PoseEdge {
  std::size_t from = 0;
  std::size_t to = 0;
  Pose to_from = Pose::Identity();
  /// Of (translation, rotation) at the origin of `to`, 1/m², 1/rad².
  Mat6d information = Mat6d::Identity();
};

struct PoseGraphParams {
  /// Squared length of an edge's residual, in sigmas, at which its line process is 1/4 and the edge
  /// counts as switched off. Six degrees of freedom stay below 28 in 9999 of 10000 cases.
  double switch_off = 28.0;
  int max_iterations = 50;  ///< of each stage of the line process
};

/// Poses that fit the edges best, and what became of each edge.
struct PoseGraphResult {
  std::vector<Pose> world_from_view;
  std::vector<double> line;          ///< line process of each edge, 1 = kept, 0 = switched off
  std::vector<double> residual;      ///< squared length in sigmas of each edge
  std::vector<std::size_t> part_of;  ///< number of each view's connected part; view 0 is in part 0
  int iterations = 0;
  bool converged = false;

  /// True when the edge took part. Choi, Zhou and Koltun 2015 cut below 1/4.
  [[nodiscard]] bool kept(std::size_t edge) const noexcept { return line[edge] >= 0.25; }
};

/// Residual of an edge: translation and rotation vector of predicted × measured⁻¹, in the frame of
/// `to`.
[[nodiscard]] Vec6d edge_residual(const PoseEdge& edge, const Pose& world_from_from,
                                  const Pose& world_from_to) noexcept;

/// Its derivatives after a motion (translation, rotation vector) of each view in its own frame.
struct EdgeJacobians {
  Mat6d by_from;
  Mat6d by_to;
};
[[nodiscard]] EdgeJacobians edge_jacobians(const PoseEdge& edge, const Pose& world_from_from,
                                           const Pose& world_from_to) noexcept;

/// Fits the poses to the edges on SE(3) by Levenberg-Marquardt, each edge under a line process
/// (Choi, Zhou and Koltun 2015, eq. 5) that is tightened in stages (graduated non-convexity, Yang
/// et al. 2020), so that a wrong edge among right ones is switched off wherever the start lies.
/// The first view of every connected part stays at its start. `start` holds one pose a view; every
/// edge's views must exist. O(views³) an iteration.
[[nodiscard]] PoseGraphResult optimise_pose_graph(std::span<const Pose> start,
                                                  std::span<const PoseEdge> edges,
                                                  const PoseGraphParams& params);

}  // namespace grapnel
