#pragma once

#include "base/geometry.h"

namespace grapnel {

/// Six distinct entries of a symmetric 3×3 matrix.
struct Symmetric3 {
  double xx = 0.0, xy = 0.0, xz = 0.0, yy = 0.0, yz = 0.0, zz = 0.0;

  void add(double x, double y, double z) noexcept {
    xx += x * x;
    xy += x * y;
    xz += x * z;
    yy += y * y;
    yz += y * z;
    zz += z * z;
  }
  /// Every element divided.
  [[nodiscard]] Symmetric3 over(double by) const noexcept {
    return {xx / by, xy / by, xz / by, yy / by, yz / by, zz / by};
  }
  /// Mean products about `mean`, where these are about the origin: a covariance.
  [[nodiscard]] Symmetric3 about(const Vec3d& mean) const noexcept {
    return {xx - mean.x() * mean.x(), xy - mean.x() * mean.y(), xz - mean.x() * mean.z(),
            yy - mean.y() * mean.y(), yz - mean.y() * mean.z(), zz - mean.z() * mean.z()};
  }
};

/// Eigenvalues ascending, and the unit eigenvectors as columns in the same order.
struct Eigen3 {
  Vec3d values = Vec3d::Zero();
  Mat3d vectors = Mat3d::Identity();
};

/// Cyclic Jacobi (Golub & Van Loan, 8.5): square roots only, so the same bits everywhere. Relative
/// to the largest eigenvalue the values are right to 1e-14.
[[nodiscard]] Eigen3 eigen_symmetric3(const Symmetric3& matrix) noexcept;

/// Eigenvalues alone, ascending, in closed form (Smith 1961). Right to 1e-14 of the largest over
/// the relative gap to the next, nearly equal ones to 1e-7 of the largest. The fast way.
[[nodiscard]] Vec3d eigenvalues_symmetric3(const Symmetric3& matrix) noexcept;

/// Unit eigenvector of the smallest eigenvalue, given `values` from eigenvalues_symmetric3.
[[nodiscard]] Vec3d smallest_eigenvector(const Symmetric3& matrix, const Vec3d& values) noexcept;

}  // namespace grapnel
