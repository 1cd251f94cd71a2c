#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace grapnel {

using Vec3f = Eigen::Vector3f;
using Vec3d = Eigen::Vector3d;
using Mat3d = Eigen::Matrix3d;
using Mat4d = Eigen::Matrix4d;
using Mat6d = Eigen::Matrix<double, 6, 6>;
using Vec6d = Eigen::Matrix<double, 6, 1>;

/// A rigid motion, double precision, metres. Named to_from: `target_from_source * p_source`.
using Pose = Eigen::Isometry3d;

/// Pinhole camera. Pixel centres are integers: u = fx x/z + cx, v = fy y/z + cy.
struct Intrinsics {
  int width = 0;
  int height = 0;
  double fx = 0.0;  ///< px
  double fy = 0.0;  ///< px
  double cx = 0.0;  ///< px
  double cy = 0.0;  ///< px

  [[nodiscard]] bool valid() const noexcept {
    return width > 0 && height > 0 && fx > 0.0 && fy > 0.0;
  }
  friend bool operator==(const Intrinsics&, const Intrinsics&) = default;
};

/// Rotation angle between two poses, radians in 0…π. Deterministic on every machine.
[[nodiscard]] double rotation_angle_rad(const Pose& a, const Pose& b) noexcept;

/// Rotation matrix of a rotation vector (axis × angle, radians), Rodrigues' formula.
[[nodiscard]] Mat3d rotation_from_vector(const Vec3d& rotation_vector_rad) noexcept;

/// Rotation vector of a rotation matrix, angle in 0…π; at π the axis' first non-zero part is
/// positive.
[[nodiscard]] Vec3d vector_from_rotation(const Mat3d& rotation) noexcept;

/// A right-handed frame about a unit vector; columns: the vector and two unit vectors across it.
[[nodiscard]] Mat3d frame_about(const Vec3d& axis) noexcept;

/// True when the upper 3×3 is a rotation within `tolerance` and the last row is 0 0 0 1.
[[nodiscard]] bool is_rigid(const Mat4d& matrix, double tolerance) noexcept;

}  // namespace grapnel
