#include "workbench/views/common_frame.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <utility>

#include "base/input_error.h"
#include "workbench/pose_graph/graph_shape.h"
#include "workbench/views/joint_fit.h"
#include "workbench/views/pair_edges.h"

namespace grapnel {
namespace {

constexpr std::size_t kShapePoints = 500;
// Readings of one view share errors (its depth's scale and bend) that no number of points averages
// out: of the order of the registrar's least match tolerance, 4 mm or a hundredth of the size,
// whose third is taken for one sigma.
constexpr double kSharedError_m = 0.004 / 3.0;
constexpr double kSharedErrorOfSize = 0.01 / 3.0;
// A loop closes when its way around is off by less than three sigmas of three edges.
constexpr double kLoopSigmas = 3.0 * 1.7320508075688772;

/// Where a view's points lie.
struct ViewShape {
  std::vector<Vec3f> points;
  Vec3d centre = Vec3d::Zero();
  double radius_m = 0.0;  ///< root mean square distance from the centre
};

ViewShape shape_of(const View& view) {
  ViewShape shape;
  shape.points = sampled_points(view, kShapePoints);
  const auto count = static_cast<double>(shape.points.size());
  for (const Vec3f& point : shape.points) shape.centre += point.cast<double>();
  shape.centre /= count;
  double square_m2 = 0.0;
  for (const Vec3f& point : shape.points) {
    square_m2 += (point.cast<double>() - shape.centre).squaredNorm();
  }
  shape.radius_m = std::sqrt(square_m2 / count);
  return shape;
}

double shared_error_m(const ViewShape& a, const ViewShape& b, const CommonFrameOptions& options) {
  if (options.shared_error_m > 0.0) return options.shared_error_m;
  const double size_m = 3.0 * std::min(a.radius_m, b.radius_m);
  return std::max(1e-9, std::min(kSharedError_m, kSharedErrorOfSize * size_m));
}

/// Information of an accepted edge: its own covariance and what the readings share, which moves
/// and turns the view about its centre.
Mat6d edge_information(const ViewEdge& edge, const ViewShape& source, double shared_m) {
  const RegistrationReport& report = edge.answer.report;
  const Vec3d centre = report.target_from_source * source.centre;
  Mat6d origin_from_centre = Mat6d::Identity();
  origin_from_centre.topRightCorner<3, 3>() << 0.0, -centre.z(), centre.y(), centre.z(), 0.0,
      -centre.x(), -centre.y(), centre.x(), 0.0;
  Mat6d shared = Mat6d::Zero();
  const double turn_rad = shared_m / std::max(source.radius_m, 1e-9);
  shared.topLeftCorner<3, 3>().diagonal().setConstant(shared_m * shared_m);
  shared.bottomRightCorner<3, 3>().diagonal().setConstant(turn_rad * turn_rad);
  const Mat6d covariance =
      report.covariance + origin_from_centre * shared * origin_from_centre.transpose();
  return covariance.inverse();
}

double mean_displacement_m(const Pose& motion, const std::vector<Vec3f>& points) {
  double sum_m = 0.0;
  for (const Vec3f& point : points) {
    const Vec3d p = point.cast<double>();
    sum_m += (motion * p - p).norm();
  }
  return sum_m / static_cast<double>(points.size());
}

/// The graph's part of the work, on the accepted edges.
class Connection {
 public:
  Connection(const std::vector<View>& views, const CommonFrameOptions& options,
             std::vector<ViewEdge> edges) {
    frame_.edges = std::move(edges);
    for (const View& view : views) shapes_.push_back(shape_of(view));
    for (std::size_t i = 0; i < frame_.edges.size(); ++i) {
      const ViewEdge& edge = frame_.edges[i];
      if (edge.answer.status != Answer::Status::Accepted) continue;
      const double shared_m = shared_error_m(shapes_[edge.source], shapes_[edge.target], options);
      accepted_.push_back(i);
      shared_m_.push_back(shared_m);
      graph_.push_back({edge.source, edge.target, edge.answer.report.target_from_source,
                        edge_information(edge, shapes_[edge.source], shared_m)});
    }
  }

  CommonFrame run() {
    const SpanningTree tree = spanning_tree(shapes_.size(), graph_, worths());
    const PoseGraphResult result =
        optimise_pose_graph(tree.world_from_view, graph_, PoseGraphParams{});
    frame_.iterations = result.iterations;
    std::vector<PoseEdge> kept;
    for (std::size_t i = 0; i < graph_.size(); ++i) {
      if (result.kept(i)) kept.push_back(graph_[i]);
    }
    place_views(result, kept);
    report_edges(result, tree);
    report_loops(kept);
    return std::move(frame_);
  }

 private:
  [[nodiscard]] double displacement_m(const Loop& loop) const {
    return mean_displacement_m(loop.closing, shapes_[loop.first_view].points);
  }

  /// What an edge deserves in the tree: first that some loop through it closes, last that one does
  /// not and none does; among equals its own overlap.
  [[nodiscard]] std::vector<double> worths() const {
    std::vector<bool> closes(graph_.size(), false);
    std::vector<bool> gapes(graph_.size(), false);
    for (const Loop& loop : triple_loops(shapes_.size(), graph_)) {
      double shared_m = 0.0;
      for (const std::size_t e : loop.edges) shared_m = std::max(shared_m, shared_m_[e]);
      const bool closed = displacement_m(loop) <= kLoopSigmas * shared_m;
      for (const std::size_t e : loop.edges) (closed ? closes : gapes)[e] = true;
    }
    std::vector<double> worth;
    for (std::size_t e = 0; e < graph_.size(); ++e) {
      const RegistrationReport& report = frame_.edges[accepted_[e]].answer.report;
      const double own = report.fitness * report.coverage;
      worth.push_back(own + (closes[e] ? 2.0 : 0.0) - (gapes[e] && !closes[e] ? 2.0 : 0.0));
    }
    return worth;
  }

  void place_views(const PoseGraphResult& result, const std::vector<PoseEdge>& kept) {
    const std::vector<std::size_t> part_of = connected_parts(shapes_.size(), kept);
    const std::vector<bool> on_loop = views_on_loops(shapes_.size(), kept);
    std::vector<Pose> part_from_world;
    for (std::size_t view = 0; view < shapes_.size(); ++view) {
      const std::size_t part = part_of[view];
      if (part == part_from_world.size()) {
        part_from_world.push_back(result.world_from_view[view].inverse());
      }
      PlacedView placed;
      placed.part = part;
      placed.connected = part == 0;
      placed.confirmed = on_loop[view];
      placed.part_from_view = part_from_world[part] * result.world_from_view[view];
      frame_.views.push_back(placed);
    }
    frame_.parts = part_from_world.size();
  }

  void report_edges(const PoseGraphResult& result, const SpanningTree& tree) {
    for (std::size_t i = 0; i < graph_.size(); ++i) {
      ViewEdge& edge = frame_.edges[accepted_[i]];
      edge.line = result.line[i];
      edge.residual_sigma = std::sqrt(result.residual[i]);
      if (!result.kept(i)) {
        edge.fate = EdgeFate::SwitchedOff;
      } else {
        edge.fate = tree.in_tree[i] ? EdgeFate::Tree : EdgeFate::Loop;
      }
    }
  }

  void report_loops(const std::vector<PoseEdge>& kept) {
    double square_m2 = 0.0;
    for (const Loop& loop : triple_loops(shapes_.size(), kept)) {
      const double off_m = displacement_m(loop);
      square_m2 += off_m * off_m;
      frame_.loops.max_m = std::max(frame_.loops.max_m, off_m);
      frame_.loops.max_rad =
          std::max(frame_.loops.max_rad, rotation_angle_rad(loop.closing, Pose::Identity()));
      ++frame_.loops.loops;
    }
    if (frame_.loops.loops > 0) {
      frame_.loops.rms_m = std::sqrt(square_m2 / static_cast<double>(frame_.loops.loops));
    }
  }

  CommonFrame frame_;
  std::vector<ViewShape> shapes_;
  std::vector<PoseEdge> graph_;
  std::vector<std::size_t> accepted_;  // graph edge → frame edge
  std::vector<double> shared_m_;       // of each graph edge
};

/// A frame's intrinsics; invalid for clouds.
Intrinsics camera_of(const View& view) {
  return view.input.is_frame() ? view.input.frame().intrinsics : Intrinsics{};
}

/// All views of the first one's part at once, where each has a camera.
void fit_connected(const std::vector<View>& views, const CommonFrameOptions& options,
                   CommonFrame& frame) {
  std::vector<JointView> joint;
  std::vector<std::size_t> view_of;
  double gate_m = 3.0 * kSharedError_m;
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (!frame.views[i].connected) continue;
    if (!camera_of(views[i]).valid()) return;
    const ViewShape shape = shape_of(views[i]);
    gate_m = std::min(gate_m, 3.0 * shared_error_m(shape, shape, options));
    joint.push_back({view_samples(views[i]), camera_of(views[i]), frame.views[i].part_from_view});
    view_of.push_back(i);
  }
  if (joint.size() < 2) return;
  JointFitOptions fit_options;
  fit_options.gate_m = gate_m;
  fit_options.fit_focal = options.fit_focal;
  const JointFit fit = fit_together(joint, fit_options);
  for (std::size_t k = 0; k < view_of.size(); ++k) {
    frame.views[view_of[k]].part_from_view = fit.world_from_view[k];
  }
  frame.joint = {true, fit.focal_factor, fit.focal_sigma, fit.rms_m, fit.partners};
}

}  // namespace

CommonFrame bring_together(const std::vector<View>& views, const CommonFrameOptions& options) {
  if (views.size() < 2) throw InputError("at least two views are needed");
  CommonFrame frame = Connection(views, options, register_pairs(views, options)).run();
  if (options.joint) fit_connected(views, options, frame);
  return frame;
}

}  // namespace grapnel
