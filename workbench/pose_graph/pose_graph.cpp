#include "workbench/pose_graph/pose_graph.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "base/assert.h"
#include "base/math.h"
#include "workbench/pose_graph/graph_shape.h"

namespace grapnel {
namespace {

constexpr std::size_t kHeld = std::numeric_limits<std::size_t>::max();
// Each stage of the line process is this much stricter than the one before.
constexpr double kTighten = 2.0;
constexpr double kFirstDamping = 1e-6;
constexpr double kMostDamping = 1e9;
// A step of less than a nanometre, and a nanoradian, changes nothing.
constexpr double kLeastStep = 1e-9;

Mat3d cross_matrix(const Vec3d& v) noexcept {
  Mat3d m;
  m << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return m;
}

/// Inverse of SO(3)'s left Jacobian: the rotation vector of exp(w) R moves by this times w.
Mat3d inverse_left_jacobian(const Vec3d& rotation_vector_rad) noexcept {
  const double square = rotation_vector_rad.squaredNorm();
  const Mat3d cross = cross_matrix(rotation_vector_rad);
  double second = 1.0 / 12.0;
  if (square > 1e-8) {
    const double angle_rad = std::sqrt(square);
    // (1 + cos a) / (2 a sin a) by the half angle, which stays finite at a half turn.
    const double half = 0.5 * angle_rad;
    second = (1.0 - half * math::cos(half) / math::sin(half)) / square;
  }
  return Mat3d::Identity() - 0.5 * cross + second * (cross * cross);
}

Pose moved(const Pose& pose, const Vec6d& step) {
  Pose motion = Pose::Identity();
  motion.linear() = rotation_from_vector(step.tail<3>());
  motion.translation() = step.head<3>();
  Pose result = pose * motion;
  // Rounding must not grow over many steps.
  const Eigen::Quaterniond turn(result.linear());
  result.linear() = turn.normalized().toRotationMatrix();
  return result;
}

/// The graph while it is fitted.
class Fit {
 public:
  Fit(std::span<const Pose> start, std::span<const PoseEdge> edges, const PoseGraphParams& params)
      : edges_(edges), params_(params) {
    result_.world_from_view.assign(start.begin(), start.end());
    result_.line.assign(edges.size(), 1.0);
    result_.residual.assign(edges.size(), 0.0);
    result_.part_of = connected_parts(start.size(), edges);
    std::vector<bool> seen(start.size(), false);
    column_of_.assign(start.size(), kHeld);
    for (std::size_t view = 0; view < start.size(); ++view) {
      const std::size_t part = result_.part_of[view];
      if (seen[part]) column_of_[view] = 6 * free_++;
      seen[part] = true;
    }
  }

  PoseGraphResult run() {
    measure(result_.world_from_view, result_.residual);
    // The weakest stage hardly bends the worst edge's parabola.
    double worst = params_.switch_off;
    for (const double residual : result_.residual) worst = std::max(worst, 2.0 * residual);
    for (double scale = worst;; scale /= kTighten) {
      const bool last = scale <= params_.switch_off;
      settle(last ? params_.switch_off : scale);
      if (last) break;
    }
    return std::move(result_);
  }

 private:
  /// Geman-McClure, what the line process amounts to: scale r² / (scale + r²).
  [[nodiscard]] static double cost(const std::vector<double>& residual, double scale) {
    double sum = 0.0;
    for (const double r2 : residual) sum += scale * r2 / (scale + r2);
    return sum;
  }

  void measure(const std::vector<Pose>& poses, std::vector<double>& residual) const {
    for (std::size_t i = 0; i < edges_.size(); ++i) {
      const Vec6d r = edge_residual(edges_[i], poses[edges_[i].from], poses[edges_[i].to]);
      residual[i] = r.dot(edges_[i].information * r);
    }
  }

  void settle(double scale) {
    result_.converged = false;
    double damping = kFirstDamping;
    for (int i = 0; i < params_.max_iterations && !result_.converged; ++i) {
      update_lines(scale);
      linearise();
      ++result_.iterations;
      if (!step(scale, damping)) result_.converged = true;
    }
    update_lines(scale);
  }

  void update_lines(double scale) {
    for (std::size_t i = 0; i < edges_.size(); ++i) {
      const double root = scale / (scale + result_.residual[i]);
      result_.line[i] = root * root;
    }
  }

  void linearise() {
    const auto size = static_cast<Eigen::Index>(6 * free_);
    hessian_ = Eigen::MatrixXd::Zero(size, size);
    gradient_ = Eigen::VectorXd::Zero(size);
    for (std::size_t i = 0; i < edges_.size(); ++i) {
      const PoseEdge& edge = edges_[i];
      const Pose& from = result_.world_from_view[edge.from];
      const Pose& to = result_.world_from_view[edge.to];
      const Vec6d residual = edge_residual(edge, from, to);
      const EdgeJacobians jacobians = edge_jacobians(edge, from, to);
      const Mat6d weight = result_.line[i] * edge.information;
      add(edge.from, edge.from, jacobians.by_from, jacobians.by_from, weight);
      add(edge.from, edge.to, jacobians.by_from, jacobians.by_to, weight);
      add(edge.to, edge.from, jacobians.by_to, jacobians.by_from, weight);
      add(edge.to, edge.to, jacobians.by_to, jacobians.by_to, weight);
      add(edge.from, jacobians.by_from.transpose() * (weight * residual));
      add(edge.to, jacobians.by_to.transpose() * (weight * residual));
    }
  }

  void add(std::size_t row_view, std::size_t column_view, const Mat6d& row, const Mat6d& column,
           const Mat6d& weight) {
    if (column_of_[row_view] == kHeld || column_of_[column_view] == kHeld) return;
    hessian_.block<6, 6>(static_cast<Eigen::Index>(column_of_[row_view]),
                         static_cast<Eigen::Index>(column_of_[column_view])) +=
        row.transpose() * weight * column;
  }
  void add(std::size_t view, const Vec6d& part) {
    if (column_of_[view] == kHeld) return;
    gradient_.segment<6>(static_cast<Eigen::Index>(column_of_[view])) += part;
  }

  /// One accepted step; false when none is left to make.
  bool step(double scale, double& damping) {
    if (free_ == 0) return false;
    const double before = cost(result_.residual, scale);
    for (; damping < kMostDamping; damping *= 10.0) {
      Eigen::MatrixXd damped = hessian_;
      // Relative and absolute, so that a direction without any information stays where it is.
      damped.diagonal() +=
          damping * hessian_.diagonal() + Eigen::VectorXd::Constant(gradient_.size(), damping);
      const Eigen::VectorXd delta = -damped.ldlt().solve(gradient_);
      if (!delta.allFinite()) continue;
      if (delta.lpNorm<Eigen::Infinity>() < kLeastStep) return false;
      std::vector<Pose> poses = result_.world_from_view;
      for (std::size_t view = 0; view < poses.size(); ++view) {
        if (column_of_[view] == kHeld) continue;
        const auto column = static_cast<Eigen::Index>(column_of_[view]);
        poses[view] = moved(poses[view], delta.segment<6>(column));
      }
      std::vector<double> residual(edges_.size());
      measure(poses, residual);
      if (!(cost(residual, scale) < before)) continue;
      result_.world_from_view = std::move(poses);
      result_.residual = std::move(residual);
      damping = std::max(kFirstDamping, 0.1 * damping);
      return true;
    }
    return false;
  }

  std::span<const PoseEdge> edges_;
  const PoseGraphParams& params_;
  PoseGraphResult result_;
  std::vector<std::size_t> column_of_;  // of each view in the equations, kHeld = stays
  std::size_t free_ = 0;
  Eigen::MatrixXd hessian_;
  Eigen::VectorXd gradient_;
};

}  // namespace

Vec6d edge_residual(const PoseEdge& edge, const Pose& world_from_from,
                    const Pose& world_from_to) noexcept {
  const Pose off = world_from_to.inverse() * world_from_from * edge.to_from.inverse();
  Vec6d residual;
  residual << off.translation(), vector_from_rotation(off.linear());
  return residual;
}

EdgeJacobians edge_jacobians(const PoseEdge& edge, const Pose& world_from_from,
                             const Pose& world_from_to) noexcept {
  const Pose predicted = world_from_to.inverse() * world_from_from;
  const Pose off = predicted * edge.to_from.inverse();
  const Mat3d inverse_left = inverse_left_jacobian(vector_from_rotation(off.linear()));
  const Mat3d& turn = predicted.linear();
  EdgeJacobians jacobians;
  // A motion (v, w) of `from` in its own frame: off = predicted × motion × measured⁻¹.
  const Vec3d lever = edge.to_from.inverse().translation();
  jacobians.by_from.setZero();
  jacobians.by_from.topLeftCorner<3, 3>() = turn;
  jacobians.by_from.topRightCorner<3, 3>() = -turn * cross_matrix(lever);
  jacobians.by_from.bottomRightCorner<3, 3>() = inverse_left * turn;
  // A motion of `to`: off = motion⁻¹ × off.
  jacobians.by_to.setZero();
  jacobians.by_to.topLeftCorner<3, 3>() = -Mat3d::Identity();
  jacobians.by_to.topRightCorner<3, 3>() = cross_matrix(off.translation());
  jacobians.by_to.bottomRightCorner<3, 3>() = -inverse_left;
  return jacobians;
}

PoseGraphResult optimise_pose_graph(std::span<const Pose> start, std::span<const PoseEdge> edges,
                                    const PoseGraphParams& params) {
  for (const PoseEdge& edge : edges) {
    GRAPNEL_ASSERT(edge.from < start.size() && edge.to < start.size());
  }
  return Fit(start, edges, params).run();
}

}  // namespace grapnel
