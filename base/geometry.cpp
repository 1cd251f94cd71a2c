#include "base/geometry.h"

#include <cmath>

#include "base/math.h"

namespace grapnel {

double rotation_angle_rad(const Pose& a, const Pose& b) noexcept {
  const Mat3d delta = a.linear().transpose() * b.linear();
  return vector_from_rotation(delta).norm();
}

Mat3d rotation_from_vector(const Vec3d& rotation_vector_rad) noexcept {
  const double angle_rad = rotation_vector_rad.norm();
  Mat3d cross;
  cross << 0.0, -rotation_vector_rad.z(), rotation_vector_rad.y(), rotation_vector_rad.z(), 0.0,
      -rotation_vector_rad.x(), -rotation_vector_rad.y(), rotation_vector_rad.x(), 0.0;
  // sin(a)/a and (1 - cos(a))/a², by their series where the quotient loses digits.
  const double square = angle_rad * angle_rad;
  const double first = angle_rad < 1e-4 ? 1.0 - square / 6.0 : math::sin(angle_rad) / angle_rad;
  const double half = 0.5 * angle_rad;
  const double half_sinc = angle_rad < 1e-4 ? 1.0 - square / 24.0 : math::sin(half) / half;
  return Mat3d::Identity() + first * cross + 0.5 * half_sinc * half_sinc * (cross * cross);
}

Vec3d vector_from_rotation(const Mat3d& r) noexcept {
  // Shepperd's choice of the largest quaternion part keeps the divisor away from zero.
  const double trace = r.trace();
  double w = 0.0;
  Vec3d v;
  if (trace > r(0, 0) && trace > r(1, 1) && trace > r(2, 2)) {
    const double s = 2.0 * std::sqrt(std::fmax(0.0, 1.0 + trace));
    w = 0.25 * s;
    v = Vec3d(r(2, 1) - r(1, 2), r(0, 2) - r(2, 0), r(1, 0) - r(0, 1)) / s;
  } else {
    int i = 0;
    if (r(1, 1) > r(0, 0)) i = 1;
    if (r(2, 2) > r(i, i)) i = 2;
    const int j = (i + 1) % 3;
    const int k = (i + 2) % 3;
    const double s = 2.0 * std::sqrt(std::fmax(0.0, 1.0 + r(i, i) - r(j, j) - r(k, k)));
    v[i] = 0.25 * s;
    v[j] = (r(j, i) + r(i, j)) / s;
    v[k] = (r(k, i) + r(i, k)) / s;
    w = (r(k, j) - r(j, k)) / s;
  }
  if (w < 0.0) {
    w = -w;
    v = -v;
  }
  const double sine = v.norm();
  if (sine < 1e-12) return 2.0 * v;
  const double angle_rad = 2.0 * math::atan2(sine, w);
  Vec3d axis = v / sine;
  if (w < 1e-12) {
    for (int i = 0; i < 3; ++i) {
      if (std::fabs(axis[i]) < 1e-12) continue;
      if (axis[i] < 0.0) axis = -axis;
      break;
    }
  }
  return axis * angle_rad;
}

Mat3d frame_about(const Vec3d& axis) noexcept {
  const Vec3d other = std::fabs(axis.z()) < 0.9 ? Vec3d::UnitZ() : Vec3d::UnitX();
  const Vec3d across = other.cross(axis).normalized();
  Mat3d frame;
  frame << axis, across, axis.cross(across);
  return frame;
}

bool is_rigid(const Mat4d& matrix, double tolerance) noexcept {
  if (!matrix.allFinite()) return false;
  const Mat3d r = matrix.topLeftCorner<3, 3>();
  const bool orthonormal =
      (r * r.transpose() - Mat3d::Identity()).cwiseAbs().maxCoeff() <= tolerance;
  const bool proper = r.determinant() > 0.0;
  const Eigen::RowVector4d last = matrix.row(3) - Eigen::RowVector4d(0.0, 0.0, 0.0, 1.0);
  return orthonormal && proper && last.cwiseAbs().maxCoeff() <= tolerance;
}

}  // namespace grapnel
