#include "workbench/calibrate/zhang.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <array>
#include <cmath>
#include <cstddef>

#include "base/input_error.h"

namespace grapnel {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::VectorXd;

constexpr std::size_t kMinViews = 3;
constexpr Eigen::Index kCamera = 8;  // fx fy cx cy k1 k2 p1 p2
constexpr Eigen::Index kPose = 6;    // rotation vector, translation
constexpr int kMaxRounds = 60;

std::vector<Vector2d> board_points(int columns, int rows, double square_m) {
  std::vector<Vector2d> points;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      points.emplace_back(column * square_m, row * square_m);
    }
  }
  return points;
}

/// Moves points to mean 0 and mean distance √2, for a well-conditioned fit (Hartley 1997).
Mat3d normaliser(const std::vector<Vector2d>& points) {
  Vector2d mean = Vector2d::Zero();
  for (const Vector2d& point : points) mean += point;
  mean /= static_cast<double>(points.size());
  double spread = 0.0;
  for (const Vector2d& point : points) spread += (point - mean).norm();
  const double scale = std::sqrt(2.0) * static_cast<double>(points.size()) / spread;
  Mat3d move = Mat3d::Identity() * scale;
  move(2, 2) = 1.0;
  move.block<2, 1>(0, 2) = -scale * mean;
  return move;
}

/// Board to image.
Mat3d fit_homography(const std::vector<Vector2d>& board, const std::vector<Vector2d>& image) {
  const Mat3d from = normaliser(board);
  const Mat3d to = normaliser(image);
  MatrixXd rows = MatrixXd::Zero(static_cast<Eigen::Index>(2 * board.size()), 9);
  for (std::size_t i = 0; i < board.size(); ++i) {
    const Vec3d b = from * board[i].homogeneous();
    const Vec3d p = to * image[i].homogeneous();
    const auto row = static_cast<Eigen::Index>(2 * i);
    rows.block<1, 3>(row, 0) = b.transpose();
    rows.block<1, 3>(row, 6) = -p.x() * b.transpose();
    rows.block<1, 3>(row + 1, 3) = b.transpose();
    rows.block<1, 3>(row + 1, 6) = -p.y() * b.transpose();
  }
  const Eigen::JacobiSVD<MatrixXd> svd(rows, Eigen::ComputeFullV);
  const VectorXd h = svd.matrixV().col(8);
  Mat3d normalised;
  normalised << h(0), h(1), h(2), h(3), h(4), h(5), h(6), h(7), h(8);
  return to.inverse() * normalised * from;
}

Eigen::Matrix<double, 1, 6> zhang_row(const Mat3d& h, int i, int j) {
  Eigen::Matrix<double, 1, 6> row;
  row << h(0, i) * h(0, j), h(0, i) * h(1, j) + h(1, i) * h(0, j), h(1, i) * h(1, j),
      h(2, i) * h(0, j) + h(0, i) * h(2, j), h(2, i) * h(1, j) + h(1, i) * h(2, j),
      h(2, i) * h(2, j);
  return row;
}

/// fx fy cx cy by Zhang 2000, appendix B.
Eigen::Vector4d closed_form(const std::vector<Mat3d>& homographies) {
  MatrixXd rows(static_cast<Eigen::Index>(2 * homographies.size()), 6);
  for (std::size_t i = 0; i < homographies.size(); ++i) {
    const Mat3d h = homographies[i] / homographies[i].norm();
    const auto row = static_cast<Eigen::Index>(2 * i);
    rows.row(row) = zhang_row(h, 0, 1);
    rows.row(row + 1) = zhang_row(h, 0, 0) - zhang_row(h, 1, 1);
  }
  const Eigen::JacobiSVD<MatrixXd> svd(rows, Eigen::ComputeFullV);
  const VectorXd b = svd.matrixV().col(5);
  const double determinant = b(0) * b(2) - b(1) * b(1);
  const double cy = (b(1) * b(3) - b(0) * b(4)) / determinant;
  const double lambda = b(5) - (b(3) * b(3) + cy * (b(1) * b(3) - b(0) * b(4))) / b(0);
  const double fx2 = lambda / b(0);
  const double fy2 = lambda * b(0) / determinant;
  if (!(fx2 > 0.0) || !(fy2 > 0.0)) {
    throw InputError(
        "the images show the board from nearly one direction; tilt it differently in each");
  }
  const double fx = std::sqrt(fx2);
  const double skew = -b(1) * fx2 * std::sqrt(fy2) / lambda;
  const double cx = skew * cy / std::sqrt(fy2) - b(3) * fx2 / lambda;
  return {fx, std::sqrt(fy2), cx, cy};
}

/// Rotation vector and translation of the board in the camera's frame.
Eigen::Matrix<double, 6, 1> pose_of(const Mat3d& homography, const Eigen::Vector4d& camera) {
  Mat3d k = Mat3d::Identity();
  k(0, 0) = camera(0);
  k(1, 1) = camera(1);
  k(0, 2) = camera(2);
  k(1, 2) = camera(3);
  Mat3d columns = k.inverse() * homography;
  columns *= 2.0 / (columns.col(0).norm() + columns.col(1).norm());
  if (columns(2, 2) < 0.0) columns = -columns;  // the board is before the camera
  Mat3d rotation;
  rotation << columns.col(0), columns.col(1), columns.col(0).cross(columns.col(1));
  const Eigen::JacobiSVD<Mat3d> svd(rotation, Eigen::ComputeFullU | Eigen::ComputeFullV);
  rotation = svd.matrixU() * svd.matrixV().transpose();
  const Eigen::AngleAxisd turn(rotation);
  Eigen::Matrix<double, 6, 1> pose;
  pose << turn.angle() * turn.axis(), columns.col(2);
  return pose;
}

/// Everything that is fitted: camera, then a pose for each image.
class Problem {
 public:
  Problem(const std::vector<BoardView>& views, std::vector<Vector2d> board)
      : views_(views), board_(std::move(board)) {}

  [[nodiscard]] Eigen::Index residuals() const {
    return static_cast<Eigen::Index>(2 * views_.size() * board_.size());
  }
  [[nodiscard]] VectorXd residuals_of_view(const VectorXd& state, std::size_t view) const {
    const Eigen::Index at = kCamera + kPose * static_cast<Eigen::Index>(view);
    const Vec3d turn = state.segment<3>(at);
    const Vec3d place = state.segment<3>(at + 3);
    const double angle = turn.norm();
    const Mat3d rotation = angle > 1e-12 ? Eigen::AngleAxisd(angle, turn / angle).toRotationMatrix()
                                         : Mat3d(Mat3d::Identity());
    VectorXd out(static_cast<Eigen::Index>(2 * board_.size()));
    for (std::size_t i = 0; i < board_.size(); ++i) {
      const Vec3d point = rotation.leftCols<2>() * board_[i] + place;
      out.segment<2>(static_cast<Eigen::Index>(2 * i)) =
          project(state, point) - views_[view].corners_px[i];
    }
    return out;
  }
  /// Of the camera's and this image's parameters, by central differences.
  [[nodiscard]] MatrixXd jacobian_of_view(const VectorXd& state, std::size_t view) const {
    MatrixXd out(static_cast<Eigen::Index>(2 * board_.size()), kCamera + kPose);
    for (Eigen::Index i = 0; i < kCamera + kPose; ++i) {
      const Eigen::Index at =
          i < kCamera ? i : kCamera + kPose * static_cast<Eigen::Index>(view) + i - kCamera;
      const double step = 1e-6 * std::max(1.0, std::abs(state(at)));
      VectorXd up = state;
      VectorXd down = state;
      up(at) += step;
      down(at) -= step;
      out.col(i) = (residuals_of_view(up, view) - residuals_of_view(down, view)) / (2.0 * step);
    }
    return out;
  }
  [[nodiscard]] std::size_t views() const { return views_.size(); }

 private:
  /// Brown 1966.
  static Vector2d project(const VectorXd& state, const Vec3d& point) {
    const double x = point.x() / point.z();
    const double y = point.y() / point.z();
    const double r2 = x * x + y * y;
    const double radial = 1.0 + r2 * (state(4) + r2 * state(5));
    const double p1 = state(6);
    const double p2 = state(7);
    return {state(0) * (x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x)) + state(2),
            state(1) * (y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y) + state(3)};
  }

  const std::vector<BoardView>& views_;
  std::vector<Vector2d> board_;
};

double cost_of(const Problem& problem, const VectorXd& state) {
  double cost = 0.0;
  for (std::size_t view = 0; view < problem.views(); ++view) {
    cost += problem.residuals_of_view(state, view).squaredNorm();
  }
  return cost;
}

/// JᵀJ and Jᵀr.
void normal_equations(const Problem& problem, const VectorXd& state, MatrixXd& normal,
                      VectorXd& gradient) {
  normal = MatrixXd::Zero(state.size(), state.size());
  gradient = VectorXd::Zero(state.size());
  for (std::size_t view = 0; view < problem.views(); ++view) {
    const MatrixXd j = problem.jacobian_of_view(state, view);
    const VectorXd r = problem.residuals_of_view(state, view);
    const MatrixXd jj = j.transpose() * j;
    const VectorXd jr = j.transpose() * r;
    const Eigen::Index at = kCamera + kPose * static_cast<Eigen::Index>(view);
    normal.topLeftCorner(kCamera, kCamera) += jj.topLeftCorner(kCamera, kCamera);
    normal.block(0, at, kCamera, kPose) = jj.topRightCorner(kCamera, kPose);
    normal.block(at, 0, kPose, kCamera) = jj.bottomLeftCorner(kPose, kCamera);
    normal.block(at, at, kPose, kPose) = jj.bottomRightCorner(kPose, kPose);
    gradient.head(kCamera) += jr.head(kCamera);
    gradient.segment(at, kPose) = jr.tail(kPose);
  }
}

/// Levenberg and Marquardt.
void refine(const Problem& problem, VectorXd& state) {
  double damping = 1e-3;
  double cost = cost_of(problem, state);
  MatrixXd normal;
  VectorXd gradient;
  for (int round = 0; round < kMaxRounds && damping < 1e12; ++round) {
    normal_equations(problem, state, normal, gradient);
    MatrixXd damped = normal;
    damped.diagonal() += damping * normal.diagonal();
    const VectorXd next = state - damped.ldlt().solve(gradient);
    const double next_cost = cost_of(problem, next);
    if (!(next_cost < cost)) {
      damping *= 10.0;
      continue;
    }
    const bool settled = cost - next_cost < 1e-12 * cost;
    state = next;
    cost = next_cost;
    damping = std::max(1e-12, 0.1 * damping);
    if (settled) break;
  }
}

CameraFit describe(const Problem& problem, const VectorXd& state, int width, int height) {
  CameraFit fit;
  fit.intrinsics = {width, height, state(0), state(1), state(2), state(3)};
  fit.distortion.assign(state.data() + 4, state.data() + kCamera);
  double cost = 0.0;
  for (std::size_t view = 0; view < problem.views(); ++view) {
    const VectorXd r = problem.residuals_of_view(state, view);
    fit.view_rms_px.push_back(std::sqrt(2.0 * r.squaredNorm() / static_cast<double>(r.size())));
    cost += r.squaredNorm();
  }
  const auto residuals = static_cast<double>(problem.residuals());
  fit.rms_px = std::sqrt(2.0 * cost / residuals);
  MatrixXd normal;
  VectorXd gradient;
  normal_equations(problem, state, normal, gradient);
  const double variance = cost / std::max(1.0, residuals - static_cast<double>(state.size()));
  const MatrixXd covariance =
      normal.ldlt().solve(MatrixXd::Identity(state.size(), state.size())) * variance;
  for (Eigen::Index i = 0; i < 4; ++i) fit.sigma_px.push_back(std::sqrt(covariance(i, i)));
  return fit;
}

}  // namespace

CameraFit fit_camera(const std::vector<BoardView>& views, int columns, int rows, double square_m,
                     int width, int height) {
  if (views.size() < kMinViews) {
    throw InputError(std::to_string(views.size()) + " images show the whole board; " +
                     std::to_string(kMinViews) + " are needed, ten are better");
  }
  const std::vector<Vector2d> board = board_points(columns, rows, square_m);
  std::vector<Mat3d> homographies;
  for (const BoardView& view : views) {
    homographies.push_back(fit_homography(board, view.corners_px));
  }
  const Eigen::Vector4d camera = closed_form(homographies);
  VectorXd state = VectorXd::Zero(kCamera + kPose * static_cast<Eigen::Index>(views.size()));
  state.head<4>() = camera;
  for (std::size_t view = 0; view < views.size(); ++view) {
    state.segment<6>(kCamera + kPose * static_cast<Eigen::Index>(view)) =
        pose_of(homographies[view], camera);
  }
  const Problem problem(views, board);
  refine(problem, state);
  return describe(problem, state, width, height);
}

}  // namespace grapnel
