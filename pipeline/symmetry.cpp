#include <array>
#include <cmath>
#include <string_view>

#include "base/input_error.h"
#include "base/math.h"
#include "pipeline/model.h"

namespace grapnel {
namespace {

constexpr std::array<std::string_view, 9> kNames = {
    "none", "x180", "y180", "z180", "box", "axis_x", "axis_y", "axis_z", "axis_z_flip"};

Mat3d half_turn(int axis) {
  Mat3d turn = -Mat3d::Identity();
  turn(axis, axis) = 1.0;
  return turn;
}

/// Rotation about `axis` that carries `rotation` nearest to `reference` (largest trace).
Mat3d best_spin(const Mat3d& rotation, const Mat3d& reference, int axis) {
  const int i = (axis + 1) % 3;
  const int j = (axis + 2) % 3;
  const Mat3d delta = reference.transpose() * rotation;
  const double cosine = delta(i, i) + delta(j, j);
  const double sine = delta(i, j) - delta(j, i);
  const double norm = std::sqrt(cosine * cosine + sine * sine);
  Mat3d spin = Mat3d::Identity();
  if (norm < 1e-12) return spin;
  spin(i, i) = spin(j, j) = cosine / norm;
  spin(j, i) = sine / norm;
  spin(i, j) = -sine / norm;
  return spin;
}

Pose turned(const Pose& pose, const Mat3d& turn) {
  Pose result = pose;
  result.linear() = pose.linear() * turn;
  return result;
}

Pose nearer(const Pose& a, const Pose& b, const Pose& reference) {
  const auto closeness = [&](const Pose& p) {
    return (reference.linear().transpose() * p.linear()).trace();
  };
  return closeness(b) > closeness(a) + 1e-12 ? b : a;
}

Pose spun(const Pose& pose, const Pose& reference, int axis) {
  return turned(pose, best_spin(pose.linear(), reference.linear(), axis));
}

}  // namespace

Pose nearest_equivalent(const Pose& found, const Pose& reference, Symmetry symmetry) noexcept {
  switch (symmetry) {
    case Symmetry::None:
      return found;
    case Symmetry::X180:
    case Symmetry::Y180:
    case Symmetry::Z180: {
      const int axis = static_cast<int>(symmetry) - static_cast<int>(Symmetry::X180);
      return nearer(found, turned(found, half_turn(axis)), reference);
    }
    case Symmetry::Box: {
      Pose best = found;
      for (int axis = 0; axis < 3; ++axis) {
        best = nearer(best, turned(found, half_turn(axis)), reference);
      }
      return best;
    }
    case Symmetry::AxisX:
    case Symmetry::AxisY:
    case Symmetry::AxisZ:
      return spun(found, reference, static_cast<int>(symmetry) - static_cast<int>(Symmetry::AxisX));
    case Symmetry::AxisZFlip:
      return nearer(spun(found, reference, 2), spun(turned(found, half_turn(0)), reference, 2),
                    reference);
  }
  return found;
}

Pose canonical_pose(const Pose& camera_from_model, const Pose& model_from_grasp,
                    Symmetry symmetry) noexcept {
  // nearest_equivalent() takes the rotation R with the largest trace(Aᵀ R). The grasp's depth is
  // the z of R g, so A = -e_z gᵀ asks for the least depth; the second term asks for the camera's
  // own axes and decides only where the depths are equal.
  constexpr double kTurnWeight = 1e-3;
  constexpr double kAtOrigin_m = 1e-3;
  const Vec3d grasp = model_from_grasp.translation();
  Pose reference = camera_from_model;
  reference.linear() = kTurnWeight * model_from_grasp.linear().transpose();
  if (grasp.norm() > kAtOrigin_m) {
    reference.linear() -= Vec3d::UnitZ() * grasp.normalized().transpose();
  }
  return nearest_equivalent(camera_from_model, reference, symmetry);
}

bool equivalent(const Pose& a, const Pose& b, Symmetry symmetry, double tolerance_m,
                double tolerance_rad) noexcept {
  if ((a.translation() - b.translation()).norm() > tolerance_m) return false;
  return rotation_angle_rad(nearest_equivalent(a, b, symmetry), b) <= tolerance_rad;
}

int free_axis(Symmetry symmetry) noexcept {
  switch (symmetry) {
    case Symmetry::AxisX:
      return 0;
    case Symmetry::AxisY:
      return 1;
    case Symmetry::AxisZ:
    case Symmetry::AxisZFlip:
      return 2;
    default:
      return -1;
  }
}

const char* symmetry_name(Symmetry symmetry) noexcept {
  return kNames[static_cast<std::size_t>(symmetry)].data();
}

Symmetry symmetry_from_name(const std::string& name) {
  std::string allowed;
  for (std::size_t i = 0; i < kNames.size(); ++i) {
    if (kNames[i] == name) return static_cast<Symmetry>(i);
    allowed += (i == 0 ? "" : ", ") + std::string(kNames[i]);
  }
  throw InputError("symmetry \"" + name + "\" is unknown; allowed: " + allowed);
}

}  // namespace grapnel
