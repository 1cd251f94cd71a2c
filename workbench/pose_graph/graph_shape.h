#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "workbench/pose_graph/pose_graph.h"

namespace grapnel {

/// The number of the connected part each view belongs to; parts are numbered by their first view.
[[nodiscard]] std::vector<std::size_t> connected_parts(std::size_t views,
                                                       std::span<const PoseEdge> edges);

/// Views i < j < k with an edge between any two of them, as indices of the edges (i, j), (j, k) and
/// (i, k) in either sense, and what is left after the way around.
struct Loop {
  std::size_t edges[3] = {0, 0, 0};
  std::size_t first_view = 0;
  Pose closing = Pose::Identity();  ///< in the frame of `first_view`; identity = closes
};

/// Every loop of three edges. Of several edges between the same two views each counts.
[[nodiscard]] std::vector<Loop> triple_loops(std::size_t views, std::span<const PoseEdge> edges);

/// Which views have an edge that is no bridge: more than one way leads there. O(edges²).
[[nodiscard]] std::vector<bool> views_on_loops(std::size_t views, std::span<const PoseEdge> edges);

/// A maximum spanning tree by `worth` (one number an edge; larger is better) of every connected
/// part, and the poses along it. The first view of each part is its root, at the identity.
struct SpanningTree {
  std::vector<bool> in_tree;  ///< of each edge
  std::vector<Pose> world_from_view;
};
[[nodiscard]] SpanningTree spanning_tree(std::size_t views, std::span<const PoseEdge> edges,
                                         std::span<const double> worth);

}  // namespace grapnel
