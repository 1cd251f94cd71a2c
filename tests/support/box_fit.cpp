#include "tests/support/box_fit.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>

namespace grapnel::test {
namespace {

using Vec2d = Eigen::Vector2d;
using Mat2d = Eigen::Matrix2d;
using Mat62d = Eigen::Matrix<double, 6, 2>;

constexpr int kRounds = 40;
constexpr int kPosesFirst = 5;
// Cut-off of residuals, from the start's error down to the noise.
constexpr double kFirstReach_m = 0.06;
constexpr double kLastReach_m = 0.012;
constexpr double kShrink = 0.85;
// Readings this near a face's side or the floor may belong to the next surface.
constexpr double kBesideEdge_m = 0.012;
constexpr double kAboveFloor_m = 0.04;
// A face with a smaller share of the readings is seen at too flat an angle.
constexpr double kLeastFace = 0.03;
constexpr double kStep_m = 0.06;
constexpr int kFarthestBackground_px = 24;
constexpr double kRimSigma_m = 0.004;
// Neighbouring readings share one error.
constexpr double kSharedSurface = 10.0;
constexpr double kSharedRim = 8.0;

/// +1 or -1: the side of the axis that the camera sees; 0: neither.
std::array<int, 3> sides_in_sight(const Pose& camera_from_box, const Vec3d& half_m) {
  const Vec3d camera = camera_from_box.inverse().translation();
  std::array<int, 3> sides{};
  for (int axis = 0; axis < 3; ++axis) {
    if (camera[axis] > half_m[axis]) sides[static_cast<std::size_t>(axis)] = 1;
    if (camera[axis] < -half_m[axis]) sides[static_cast<std::size_t>(axis)] = -1;
  }
  return sides;
}

/// Axis of the face in sight that the point (box frame) lies on within `reach_m`, else -1.
int face_of(const Vec3d& p, const std::array<int, 3>& sides, const Vec3d& half_m, double reach_m) {
  if (p.z() < kAboveFloor_m - half_m.z()) return -1;
  int found = -1;
  double nearest_m = reach_m;
  for (int axis = 0; axis < 3; ++axis) {
    const int side = sides[static_cast<std::size_t>(axis)];
    if (side == 0) continue;
    const int b = (axis + 1) % 3;
    const int c = (axis + 2) % 3;
    const double off_m = std::fabs(side * p[axis] - half_m[axis]);
    if (off_m >= nearest_m || std::fabs(p[b]) > half_m[b] - kBesideEdge_m ||
        std::fabs(p[c]) > half_m[c] - kBesideEdge_m) {
      continue;
    }
    nearest_m = off_m;
    found = axis;
  }
  return found;
}

/// Axis of the hidden side whose edge with a face in sight the rim point marks, else -1.
int hidden_side_of(const Vec3d& p, const std::array<int, 3>& sides, const Vec3d& half_m,
                   double reach_m) {
  if (p.z() < kAboveFloor_m - half_m.z()) return -1;
  constexpr double kOnFace_m = 0.02;
  int hidden = -1;
  double nearest_m = reach_m + 0.01;
  bool on_face = false;
  for (int axis = 0; axis < 3; ++axis) {
    const int side = p[axis] > 0.0 ? 1 : -1;
    const double off_m = std::fabs(p[axis]) - half_m[axis];
    if (off_m > 0.03) return -1;
    if (side == sides[static_cast<std::size_t>(axis)]) {
      on_face = on_face || std::fabs(off_m) < kOnFace_m;
    } else if (std::fabs(off_m) < nearest_m && !(axis == 2 && side < 0)) {
      nearest_m = std::fabs(off_m);
      hidden = axis;
    }
  }
  return on_face ? hidden : -1;
}

/// Normal equations of one view: its pose (turn, shift; box frame) and the shared half sizes.
struct Equations {
  Mat6d pose = Mat6d::Identity() * 1e-3;
  Mat62d mixed = Mat62d::Zero();
  Mat2d size = Mat2d::Zero();
  Vec6d pose_right = Vec6d::Zero();
  Vec2d size_right = Vec2d::Zero();

  /// The point shall lie on the side `side` of `axis`.
  void add(const Vec3d& p, int axis, int side, double half_m, double sigma_m, double shared) {
    const double off_m = side * p[axis] - half_m;
    Vec3d normal = Vec3d::Zero();
    normal[axis] = side;
    Vec6d row;
    row << -p.cross(normal), -normal;
    Vec2d size_row = Vec2d::Zero();
    if (axis < 2) size_row[axis] = -1.0;
    const double relative = off_m / (2.0 * sigma_m);
    const double robust = 1.0 / ((1.0 + relative * relative) * (1.0 + relative * relative));
    const double weight = robust / (sigma_m * sigma_m * shared);
    pose += weight * row * row.transpose();
    mixed += weight * row * size_row.transpose();
    size += weight * size_row * size_row.transpose();
    pose_right += weight * off_m * row;
    size_right += weight * off_m * size_row;
  }
};

Equations equations_of(const BoxView& view, const Vec3d& half_m, double reach_m) {
  Equations equations;
  const std::array<int, 3> sides = sides_in_sight(view.camera_from_box, half_m);
  const Pose box_from_camera = view.camera_from_box.inverse();
  std::vector<int> faces(view.surface.size());
  std::array<double, 3> count{};
  for (std::size_t i = 0; i < faces.size(); ++i) {
    faces[i] = face_of(box_from_camera * view.surface[i], sides, half_m, reach_m);
    if (faces[i] >= 0) count[static_cast<std::size_t>(faces[i])] += 1.0;
  }
  const double fewest = kLeastFace * (count[0] + count[1] + count[2]);
  for (std::size_t i = 0; i < faces.size(); ++i) {
    if (faces[i] < 0 || count[static_cast<std::size_t>(faces[i])] < fewest) continue;
    const double z_m = view.surface[i].z();
    equations.add(box_from_camera * view.surface[i], faces[i],
                  sides[static_cast<std::size_t>(faces[i])], half_m[faces[i]],
                  0.003 + 0.0015 * z_m * z_m, kSharedSurface);
  }
  for (const Vec3d& point : view.rim) {
    const Vec3d p = box_from_camera * point;
    const int axis = hidden_side_of(p, sides, half_m, reach_m);
    if (axis < 0) continue;
    equations.add(p, axis, p[axis] > 0.0 ? 1 : -1, half_m[axis], kRimSigma_m, kSharedRim);
  }
  return equations;
}

Vec3d point_at(const DepthPicture& picture, double u, double v, double z_m) {
  const Intrinsics& k = picture.camera;
  return {(u - k.cx) / k.fx * z_m, (v - k.cy) / k.fy * z_m, z_m};
}

/// The depth jumps away from (u, v) toward (du, dv): onto something measured, not into a hole.
bool is_rim(const DepthPicture& picture, int u, int v, int du, int dv) {
  const auto z_at = [&](int steps) {
    const int x = u + steps * du;
    const int y = v + steps * dv;
    if (x < 0 || y < 0 || x >= picture.counts.width || y >= picture.counts.height) return 0.0;
    return picture.counts.at(x, y) * picture.metres_per_unit;
  };
  const double z_m = z_at(0);
  const double next_m = z_at(1);
  const double inner_m = z_at(-2);
  if (next_m > 0.0 && next_m < z_m + kStep_m) return false;
  if (!(inner_m > 0.0) || std::fabs(inner_m - z_m) > kStep_m) return false;
  for (int steps = 1; steps < kFarthestBackground_px; ++steps) {
    if (z_at(steps) > z_m + kStep_m) return true;
  }
  return false;
}

void move(BoxView& view, const Vec6d& step) {
  Pose motion = Pose::Identity();
  motion.linear() = rotation_from_vector(step.head<3>());
  motion.translation() = step.tail<3>();
  view.camera_from_box = view.camera_from_box * motion;
}

}  // namespace

BoxView box_view(const DepthPicture& picture, const Pose& camera_from_box, const Vec3d& half_m,
                 double reach_m) {
  BoxView view;
  view.camera_from_box = camera_from_box;
  const Pose box_from_camera = camera_from_box.inverse();
  const auto near = [&](const Vec3d& point) {
    const Vec3d p = box_from_camera * point;
    return std::fabs((p.cwiseAbs() - half_m).maxCoeff()) < reach_m;
  };
  constexpr std::array<std::array<int, 2>, 4> kAround = {{{1, 0}, {-1, 0}, {0, 1}, {0, -1}}};
  for (int v = 0; v < picture.counts.height; ++v) {
    for (int u = 0; u < picture.counts.width; ++u) {
      const double z_m = picture.counts.at(u, v) * picture.metres_per_unit;
      if (!(z_m > 0.0) || !near(point_at(picture, u, v, z_m))) continue;
      // A quarter of the readings is plenty.
      if (u % 2 == 0 && v % 2 == 0) view.surface.push_back(point_at(picture, u, v, z_m));
      for (const auto& [du, dv] : kAround) {
        if (!is_rim(picture, u, v, du, dv)) continue;
        view.rim.push_back(point_at(picture, u + 0.5 * du, v + 0.5 * dv, z_m));
      }
    }
  }
  return view;
}

void fit_boxes(std::span<BoxView> views, Vec3d& half_m) {
  double reach_m = kFirstReach_m;
  for (int round = 0; round < kRounds; ++round) {
    std::vector<Equations> all;
    Mat2d left = Mat2d::Identity() * 1e-3;
    Vec2d right = Vec2d::Zero();
    for (const BoxView& view : views) {
      all.push_back(equations_of(view, half_m, reach_m));
      const Equations& e = all.back();
      const Eigen::LDLT<Mat6d> pose(e.pose);
      left += e.size - e.mixed.transpose() * pose.solve(e.mixed);
      right += e.size_right - e.mixed.transpose() * pose.solve(e.pose_right);
    }
    Vec2d grown = Vec2d::Zero();
    if (round >= kPosesFirst) grown = (-left.ldlt().solve(right)).cwiseMax(-0.01).cwiseMin(0.01);
    half_m.head<2>() += grown;
    for (std::size_t i = 0; i < views.size(); ++i) {
      const Equations& e = all[i];
      move(views[i], -Eigen::LDLT<Mat6d>(e.pose).solve(e.pose_right + e.mixed * grown));
    }
    reach_m = std::max(kLastReach_m, kShrink * reach_m);
  }
}

double median_residual_m(const BoxView& view, const Vec3d& half_m) {
  const std::array<int, 3> sides = sides_in_sight(view.camera_from_box, half_m);
  const Pose box_from_camera = view.camera_from_box.inverse();
  std::vector<double> off_m;
  for (const Vec3d& point : view.surface) {
    const Vec3d p = box_from_camera * point;
    const int axis = face_of(p, sides, half_m, 0.05);
    if (axis < 0) continue;
    off_m.push_back(std::fabs(sides[static_cast<std::size_t>(axis)] * p[axis] - half_m[axis]));
  }
  if (off_m.empty()) return 1.0;
  const auto middle = off_m.begin() + static_cast<std::ptrdiff_t>(off_m.size() / 2);
  std::nth_element(off_m.begin(), middle, off_m.end());
  return *middle;
}

}  // namespace grapnel::test
