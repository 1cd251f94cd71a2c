#include "workbench/pose_graph/graph_shape.h"

#include <algorithm>
#include <numeric>

namespace grapnel {
namespace {

/// Disjoint sets of views; each is known by its smallest member.
class ViewSets {
 public:
  explicit ViewSets(std::size_t views) : parent_(views) {
    std::iota(parent_.begin(), parent_.end(), std::size_t{0});
  }
  std::size_t find(std::size_t view) {
    while (parent_[view] != view) view = parent_[view] = parent_[parent_[view]];
    return view;
  }
  /// False when they were one set already.
  bool join(std::size_t a, std::size_t b) {
    a = find(a);
    b = find(b);
    if (a == b) return false;
    parent_[std::max(a, b)] = std::min(a, b);
    return true;
  }

 private:
  std::vector<std::size_t> parent_;
};

/// The edge's motion into the frame of `to`, whichever way round it was measured.
Pose motion_to(const PoseEdge& edge, std::size_t to) {
  return edge.to == to ? edge.to_from : edge.to_from.inverse();
}

}  // namespace

std::vector<std::size_t> connected_parts(std::size_t views, std::span<const PoseEdge> edges) {
  ViewSets sets(views);
  for (const PoseEdge& edge : edges) sets.join(edge.from, edge.to);
  std::vector<std::size_t> part_of(views);
  std::size_t parts = 0;
  for (std::size_t view = 0; view < views; ++view) {
    const std::size_t root = sets.find(view);
    part_of[view] = root == view ? parts++ : part_of[root];
  }
  return part_of;
}

std::vector<bool> views_on_loops(std::size_t views, std::span<const PoseEdge> edges) {
  std::vector<bool> on_loop(views, false);
  for (std::size_t without = 0; without < edges.size(); ++without) {
    ViewSets sets(views);
    for (std::size_t e = 0; e < edges.size(); ++e) {
      if (e != without) sets.join(edges[e].from, edges[e].to);
    }
    if (sets.find(edges[without].from) != sets.find(edges[without].to)) continue;
    on_loop[edges[without].from] = true;
    on_loop[edges[without].to] = true;
  }
  return on_loop;
}

std::vector<Loop> triple_loops(std::size_t views, std::span<const PoseEdge> edges) {
  // of_pair[i][j], i < j: the edges between them.
  std::vector<std::vector<std::vector<std::size_t>>> of_pair(
      views, std::vector<std::vector<std::size_t>>(views));
  for (std::size_t e = 0; e < edges.size(); ++e) {
    const auto [low, high] = std::minmax(edges[e].from, edges[e].to);
    of_pair[low][high].push_back(e);
  }
  std::vector<Loop> loops;
  const auto close = [&](std::size_t i, std::size_t j, std::size_t k) {
    for (const std::size_t ij : of_pair[i][j]) {
      for (const std::size_t jk : of_pair[j][k]) {
        for (const std::size_t ik : of_pair[i][k]) {
          const Pose closing =
              motion_to(edges[ik], i) * motion_to(edges[jk], k) * motion_to(edges[ij], j);
          loops.push_back({{ij, jk, ik}, i, closing});
        }
      }
    }
  };
  for (std::size_t i = 0; i < views; ++i) {
    for (std::size_t j = i + 1; j < views; ++j) {
      if (of_pair[i][j].empty()) continue;
      for (std::size_t k = j + 1; k < views; ++k) close(i, j, k);
    }
  }
  return loops;
}

SpanningTree spanning_tree(std::size_t views, std::span<const PoseEdge> edges,
                           std::span<const double> worth) {
  std::vector<std::size_t> order(edges.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return worth[a] > worth[b]; });
  SpanningTree tree;
  tree.in_tree.assign(edges.size(), false);
  tree.world_from_view.assign(views, Pose::Identity());
  ViewSets sets(views);
  std::vector<std::vector<std::size_t>> edges_of(views);
  for (const std::size_t e : order) {
    if (!sets.join(edges[e].from, edges[e].to)) continue;
    tree.in_tree[e] = true;
    edges_of[edges[e].from].push_back(e);
    edges_of[edges[e].to].push_back(e);
  }
  std::vector<bool> placed(views, false);
  for (std::size_t root = 0; root < views; ++root) {
    if (placed[root]) continue;
    placed[root] = true;
    std::vector<std::size_t> open = {root};
    while (!open.empty()) {
      const std::size_t view = open.back();
      open.pop_back();
      for (const std::size_t e : edges_of[view]) {
        const std::size_t next = edges[e].from == view ? edges[e].to : edges[e].from;
        if (placed[next]) continue;
        placed[next] = true;
        tree.world_from_view[next] = tree.world_from_view[view] * motion_to(edges[e], view);
        open.push_back(next);
      }
    }
  }
  return tree;
}

}  // namespace grapnel
