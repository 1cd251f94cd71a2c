#include "workbench/evaluate/pose_error.h"

#include <limits>

#include "base/math.h"

namespace grapnel {
namespace {

/// Half a turn about a coordinate axis.
Pose half_turn(int axis) {
  Pose turn = Pose::Identity();
  for (int i = 0; i < 3; ++i) turn.linear()(i, i) = i == axis ? 1.0 : -1.0;
  return turn;
}

/// The turn R about `axis` that maximises trace(found^T truth R), so the angle between found and
/// truth R is least: the trace is a + b cos + c sin of the angle.
Pose best_turn(int axis, const Mat3d& found_from_truth) {
  const int i = (axis + 1) % 3;
  const int j = (axis + 2) % 3;
  const double b = found_from_truth(i, i) + found_from_truth(j, j);
  const double c = found_from_truth(i, j) - found_from_truth(j, i);
  Vec3d turn_rad = Vec3d::Zero();
  turn_rad[axis] = math::atan2(c, b);
  Pose turn = Pose::Identity();
  turn.linear() = rotation_from_vector(turn_rad);
  return turn;
}

double mean_displacement_m(const Pose& a, const Pose& b, std::span<const Vec3f> points) {
  const Mat3d rotation = a.linear() - b.linear();
  const Vec3d shift = a.translation() - b.translation();
  if (points.empty()) return shift.norm();
  double sum = 0.0;
  for (const Vec3f& point : points) sum += (rotation * point.cast<double>() + shift).norm();
  return sum / static_cast<double>(points.size());
}

}  // namespace

std::vector<Pose> symmetry_motions(Symmetry symmetry, const Pose& found,
                                   const Pose& target_from_source) {
  const auto turned = [&](int axis, const Pose& first) {
    const Mat3d seen = found.linear().transpose() * target_from_source.linear() * first.linear();
    return first * best_turn(axis, seen);
  };
  const Pose still = Pose::Identity();
  switch (symmetry) {
    case Symmetry::None:
      return {still};
    case Symmetry::X180:
      return {still, half_turn(0)};
    case Symmetry::Y180:
      return {still, half_turn(1)};
    case Symmetry::Z180:
      return {still, half_turn(2)};
    case Symmetry::Box:
      return {still, half_turn(0), half_turn(1), half_turn(2)};
    case Symmetry::AxisX:
      return {turned(0, still)};
    case Symmetry::AxisY:
      return {turned(1, still)};
    case Symmetry::AxisZ:
      return {turned(2, still)};
    case Symmetry::AxisZFlip:
      return {turned(2, still), turned(2, half_turn(0))};
  }
  return {still};
}

PoseError pose_error(const Pose& found, const Pose& truth, Symmetry symmetry,
                     std::span<const Vec3f> source_points) {
  PoseError best;
  best.mean_displacement_m = std::numeric_limits<double>::infinity();
  for (const Pose& motion : symmetry_motions(symmetry, found, truth)) {
    const Pose equivalent = truth * motion;
    const double displacement_m = mean_displacement_m(found, equivalent, source_points);
    if (displacement_m < best.mean_displacement_m) {
      best = {displacement_m, rotation_angle_rad(found, equivalent), equivalent};
    }
  }
  return best;
}

}  // namespace grapnel
