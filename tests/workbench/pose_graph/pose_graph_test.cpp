#include "workbench/pose_graph/pose_graph.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "base/rng.h"
#include "workbench/pose_graph/graph_shape.h"

namespace grapnel {
namespace {

Vec3d random_vector(Rng& rng, double length) {
  return length * Vec3d(rng.uniform(-1.0, 1.0), rng.uniform(-1.0, 1.0), rng.uniform(-1.0, 1.0));
}

Pose random_pose(Rng& rng, double shift_m, double turn_rad) {
  Pose pose = Pose::Identity();
  pose.linear() = rotation_from_vector(random_vector(rng, turn_rad));
  pose.translation() = random_vector(rng, shift_m);
  return pose;
}

/// Views on a circle of half a metre around an object, as on a turntable.
std::vector<Pose> turntable(std::size_t views) {
  std::vector<Pose> poses;
  for (std::size_t i = 0; i < views; ++i) {
    Pose pose = Pose::Identity();
    const double angle_rad =
        6.283185307179586 * static_cast<double>(i) / static_cast<double>(views);
    pose.linear() = rotation_from_vector(Vec3d(0.0, angle_rad, 0.0));
    pose.translation() = pose.linear() * Vec3d(0.0, 0.0, -0.5);
    poses.push_back(pose);
  }
  return poses;
}

/// Millimetre and milliradian.
Mat6d information() { return 1e6 * Mat6d::Identity(); }

PoseEdge true_edge(const std::vector<Pose>& truth, std::size_t from, std::size_t to) {
  return {from, to, truth[to].inverse() * truth[from], information()};
}

std::vector<PoseEdge> all_edges(const std::vector<Pose>& truth) {
  std::vector<PoseEdge> edges;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    for (std::size_t j = i + 1; j < truth.size(); ++j) edges.push_back(true_edge(truth, i, j));
  }
  return edges;
}

/// Largest difference of poses relative to view 0.
double worst_shift_m(const PoseGraphResult& result, const std::vector<Pose>& truth) {
  double worst = 0.0;
  const Pose align = truth[0] * result.world_from_view[0].inverse();
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const Pose found = align * result.world_from_view[i];
    worst = std::max(worst, (found.matrix() - truth[i].matrix()).cwiseAbs().maxCoeff());
  }
  return worst;
}

TEST(PoseGraph, JacobiansAgreeWithNumericDifferences) {
  Rng rng(5);
  for (int round = 0; round < 50; ++round) {
    const Pose from = random_pose(rng, 1.0, 1.2);
    const Pose to = random_pose(rng, 1.0, 1.2);
    PoseEdge edge;
    edge.to_from = random_pose(rng, 0.3, 0.3) * to.inverse() * from;
    const EdgeJacobians jacobians = edge_jacobians(edge, from, to);
    constexpr double kStep = 1e-6;
    for (int k = 0; k < 6; ++k) {
      const auto nudged = [&](const Pose& pose, double step) {
        Vec6d d = Vec6d::Zero();
        d[k] = step;
        Pose motion = Pose::Identity();
        motion.linear() = rotation_from_vector(d.tail<3>());
        motion.translation() = d.head<3>();
        return Pose(pose * motion);
      };
      const Vec6d by_from = (edge_residual(edge, nudged(from, kStep), to) -
                             edge_residual(edge, nudged(from, -kStep), to)) /
                            (2.0 * kStep);
      const Vec6d by_to = (edge_residual(edge, from, nudged(to, kStep)) -
                           edge_residual(edge, from, nudged(to, -kStep))) /
                          (2.0 * kStep);
      // Central differences of a step of 1e-6 are good to about 1e-9.
      EXPECT_LT((by_from - jacobians.by_from.col(k)).norm(), 1e-7);
      EXPECT_LT((by_to - jacobians.by_to.col(k)).norm(), 1e-7);
    }
  }
}

TEST(PoseGraph, FindsThePosesOfExactEdgesFromADisturbedStart) {
  const std::vector<Pose> truth = turntable(12);
  Rng rng(7);
  std::vector<Pose> start = truth;
  for (std::size_t i = 1; i < start.size(); ++i) start[i] = start[i] * random_pose(rng, 0.2, 0.3);
  const PoseGraphResult result = optimise_pose_graph(start, all_edges(truth), {});
  EXPECT_TRUE(result.converged);
  EXPECT_LT(worst_shift_m(result, truth), 1e-8);
}

TEST(PoseGraph, SharesTheMisfitOfACycleByTheEdgesCovariances) {
  // Three views on a line, 1 m apart; the long edge says 3 cm more and is known four times better.
  std::vector<PoseEdge> edges(3);
  const auto measured = [](std::size_t from, std::size_t to, double x, double weight) {
    PoseEdge edge{from, to, Pose::Identity(), weight * Mat6d::Identity()};
    edge.to_from.translation().x() = x;
    return edge;
  };
  edges = {measured(1, 0, 1.0, 1.0), measured(2, 1, 1.0, 1.0), measured(2, 0, 2.03, 4.0)};
  const std::vector<Pose> start(3, Pose::Identity());
  const PoseGraphResult result = optimise_pose_graph(start, edges, {});
  // Lagrange: misfit × own variance / sum of variances. Residuals of 0.01 sigma leave the line
  // process at 1 - 1e-5.
  const double unit_m = 0.03 / 2.25;
  EXPECT_NEAR(result.world_from_view[1].translation().x(), 1.0 + unit_m, 1e-6);
  EXPECT_NEAR(result.world_from_view[2].translation().x(), 2.0 + 2.0 * unit_m, 1e-6);
}

TEST(PoseGraph, SharesTheMisfitOfATurnAmongEqualEdges) {
  std::vector<PoseEdge> edges;
  const double third_rad = 2.0943951023931953;
  for (std::size_t i = 0; i < 3; ++i) {
    PoseEdge edge{i, (i + 1) % 3, Pose::Identity(), Mat6d::Identity()};
    edge.to_from.linear() = rotation_from_vector(Vec3d(0.0, 0.0, third_rad + 0.01));
    edges.push_back(edge);
  }
  const std::vector<double> worth(3, 1.0);
  const SpanningTree tree = spanning_tree(3, edges, worth);
  const PoseGraphResult result = optimise_pose_graph(tree.world_from_view, edges, {});
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(std::sqrt(result.residual[i]), 0.01, 1e-7);
  }
}

TEST(PoseGraph, SwitchesOffAWrongEdgeAmongRightOnesThoughItWasInTheTree) {
  const std::vector<Pose> truth = turntable(8);
  std::vector<PoseEdge> edges = all_edges(truth);
  Rng rng(11);
  edges[0].to_from = random_pose(rng, 0.3, 1.0) * edges[0].to_from;  // views 0 and 1
  std::vector<double> worth(edges.size(), 1.0);
  worth[0] = 2.0;
  const SpanningTree tree = spanning_tree(truth.size(), edges, worth);
  ASSERT_TRUE(tree.in_tree[0]);
  const PoseGraphResult result = optimise_pose_graph(tree.world_from_view, edges, {});
  EXPECT_FALSE(result.kept(0));
  for (std::size_t e = 1; e < edges.size(); ++e) EXPECT_TRUE(result.kept(e)) << e;
  EXPECT_LT(worst_shift_m(result, truth), 1e-5);
}

TEST(PoseGraph, SurvivesWrongEdgesThatAreHalfOfAll) {
  const std::vector<Pose> truth = turntable(12);
  int right = 0;
  constexpr int kRounds = 20;
  for (int round = 0; round < kRounds; ++round) {
    Rng rng(static_cast<std::uint64_t>(100 + round));
    std::vector<PoseEdge> edges = all_edges(truth);
    std::vector<bool> wrong(edges.size());
    for (std::size_t e = 0; e < edges.size(); ++e) {
      // Neighbours keep a right edge: Choi, Zhou and Koltun trust those, too.
      const std::size_t apart = edges[e].to - edges[e].from;
      wrong[e] = apart != 1 && rng.uniform(0.0, 1.0) < 0.6;
      if (wrong[e]) edges[e].to_from = random_pose(rng, 0.5, 1.5) * edges[e].to_from;
    }
    std::vector<double> worth(edges.size());
    for (std::size_t e = 0; e < edges.size(); ++e) {
      worth[e] = 1.0 / static_cast<double>(edges[e].to - edges[e].from);
    }
    const SpanningTree tree = spanning_tree(truth.size(), edges, worth);
    const PoseGraphResult result = optimise_pose_graph(tree.world_from_view, edges, {});
    bool all = worst_shift_m(result, truth) < 1e-4;
    for (std::size_t e = 0; e < edges.size(); ++e) all = all && result.kept(e) == !wrong[e];
    right += all ? 1 : 0;
  }
  EXPECT_EQ(right, kRounds);
}

TEST(PoseGraph, HoldsTheFirstViewOfEveryPart) {
  const std::vector<Pose> truth = turntable(6);
  Rng rng(3);
  const Pose world = random_pose(rng, 2.0, 1.5);
  std::vector<Pose> start;
  for (const Pose& pose : truth) start.push_back(world * pose * random_pose(rng, 0.02, 0.02));
  // Views 0 1 2 and views 3 4 5 know nothing of each other.
  const std::vector<PoseEdge> edges = {true_edge(truth, 0, 1), true_edge(truth, 1, 2),
                                       true_edge(truth, 3, 4), true_edge(truth, 4, 5)};
  const PoseGraphResult result = optimise_pose_graph(start, edges, {});
  EXPECT_EQ(result.part_of, (std::vector<std::size_t>{0, 0, 0, 1, 1, 1}));
  EXPECT_EQ(result.world_from_view[0].matrix(), start[0].matrix());
  EXPECT_EQ(result.world_from_view[3].matrix(), start[3].matrix());
  for (const double residual : result.residual) EXPECT_LT(residual, 1e-6);
}

TEST(PoseGraph, LeavesAloneWhatNoEdgeSpeaksOf) {
  const std::vector<Pose> start = turntable(3);
  const PoseGraphResult none = optimise_pose_graph(start, {}, {});
  EXPECT_TRUE(none.converged);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(none.world_from_view[i].matrix(), start[i].matrix());
    EXPECT_EQ(none.part_of[i], i);
  }
  EXPECT_TRUE(optimise_pose_graph({}, {}, {}).world_from_view.empty());
}

TEST(PoseGraph, StaysFiniteWhereAnEdgeKnowsNothingOfSomeDirections) {
  const std::vector<Pose> truth = turntable(3);
  std::vector<PoseEdge> edges = {true_edge(truth, 0, 1), true_edge(truth, 1, 2)};
  edges[1].information = Mat6d::Zero();
  edges[1].information(2, 2) = 1e6;  // one distance only
  const PoseGraphResult result = optimise_pose_graph(truth, edges, {});
  for (const Pose& pose : result.world_from_view) EXPECT_TRUE(pose.matrix().allFinite());
  EXPECT_LT(worst_shift_m(result, truth), 1e-8);
}

TEST(GraphShape, LoopsOfExactEdgesCloseWhicheverWayTheyWereMeasured) {
  const std::vector<Pose> truth = turntable(5);
  std::vector<PoseEdge> edges;
  for (const auto& [from, to] : {std::pair(0, 2), std::pair(4, 2), std::pair(4, 0), std::pair(1, 3),
                                 std::pair(3, 0), std::pair(1, 0)}) {
    edges.push_back(true_edge(truth, static_cast<std::size_t>(from), static_cast<std::size_t>(to)));
  }
  const std::vector<Loop> loops = triple_loops(5, edges);
  ASSERT_EQ(loops.size(), 2U);  // 0 2 4 and 0 1 3
  for (const Loop& loop : loops) {
    EXPECT_EQ(loop.first_view, 0U);
    EXPECT_LT((loop.closing.matrix() - Mat4d::Identity()).norm(), 1e-12);
  }
}

TEST(GraphShape, ASpanningTreeTakesTheMostWorthyEdges) {
  const std::vector<Pose> truth = turntable(4);
  const std::vector<PoseEdge> edges = {true_edge(truth, 0, 1), true_edge(truth, 1, 2),
                                       true_edge(truth, 0, 2), true_edge(truth, 2, 3)};
  const std::vector<double> worth = {0.2, 0.9, 0.5, 0.1};
  const SpanningTree tree = spanning_tree(4, edges, worth);
  EXPECT_EQ(tree.in_tree, (std::vector<bool>{false, true, true, true}));
  for (std::size_t i = 0; i < 4; ++i) {
    const Pose expected = truth[0].inverse() * truth[i];
    EXPECT_LT((tree.world_from_view[i].matrix() - expected.matrix()).norm(), 1e-12);
  }
}

}  // namespace
}  // namespace grapnel
