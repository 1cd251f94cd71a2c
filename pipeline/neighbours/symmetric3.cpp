#include "pipeline/neighbours/symmetric3.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace grapnel {

namespace {

using Matrix = std::array<std::array<double, 3>, 3>;

/// One Jacobi rotation that clears entry (p, q).
void rotate(Matrix& a, Matrix& v, std::size_t p, std::size_t q) noexcept {
  if (a[p][q] == 0.0) return;
  const double theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
  const double root = std::sqrt(theta * theta + 1.0);
  const double t = theta >= 0.0 ? 1.0 / (theta + root) : 1.0 / (theta - root);
  const double c = 1.0 / std::sqrt(t * t + 1.0);
  const double s = t * c;
  const double off = a[p][q];
  a[p][p] -= t * off;
  a[q][q] += t * off;
  a[p][q] = 0.0;
  a[q][p] = 0.0;
  const std::size_t r = 3 - p - q;
  const double rp = a[r][p];
  const double rq = a[r][q];
  a[r][p] = c * rp - s * rq;
  a[r][q] = s * rp + c * rq;
  a[p][r] = a[r][p];
  a[q][r] = a[r][q];
  for (std::size_t row = 0; row < 3; ++row) {
    const double vp = v[row][p];
    const double vq = v[row][q];
    v[row][p] = c * vp - s * vq;
    v[row][q] = s * vp + c * vq;
  }
}

/// cos(acos(r) / 3) - 1/2, for e = 1 + r in 0…2: the root g of 6g² + 4g³ = e, from
/// cos(3a) = 4 cos³(a) - 3 cos(a). The start is right to 4 %, which four of Newton's steps turn
/// into the last bit, near the double root at e = 0 too.
double trisected_cosine(double e) noexcept {
  double g = std::sqrt(e / 6.0) * (1.0 - 0.067 * e);
  for (int i = 0; i < 4; ++i) {
    const double square = g * g;
    const double value = 6.0 * square + 4.0 * square * g - e;
    const double slope = 12.0 * (g + square);
    g -= value / std::max(slope, 1e-300);
  }
  return g;
}

}  // namespace

Eigen3 eigen_symmetric3(const Symmetric3& matrix) noexcept {
  Matrix a = {{{matrix.xx, matrix.xy, matrix.xz},
               {matrix.xy, matrix.yy, matrix.yz},
               {matrix.xz, matrix.yz, matrix.zz}}};
  Matrix v = {{{1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}}};
  const double scale = std::fabs(matrix.xx) + std::fabs(matrix.yy) + std::fabs(matrix.zz);
  // Converges quadratically: five sweeps reach the last bit from any start.
  constexpr int kSweeps = 8;
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    const double off = std::fabs(a[0][1]) + std::fabs(a[0][2]) + std::fabs(a[1][2]);
    if (off <= 1e-17 * scale) break;
    rotate(a, v, 0, 1);
    rotate(a, v, 0, 2);
    rotate(a, v, 1, 2);
  }
  std::array<std::size_t, 3> order = {0, 1, 2};
  const auto exchange = [&](std::size_t i, std::size_t j) {
    if (a[order[j]][order[j]] < a[order[i]][order[i]]) std::swap(order[i], order[j]);
  };
  exchange(0, 1);
  exchange(1, 2);
  exchange(0, 1);
  Eigen3 result;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto column = static_cast<Eigen::Index>(k);
    result.values[column] = a[order[k]][order[k]];
    for (std::size_t row = 0; row < 3; ++row) {
      result.vectors(static_cast<Eigen::Index>(row), column) = v[row][order[k]];
    }
  }
  return result;
}

Vec3d eigenvalues_symmetric3(const Symmetric3& m) noexcept {
  const double q = (m.xx + m.yy + m.zz) / 3.0;
  const double xx = m.xx - q;
  const double yy = m.yy - q;
  const double zz = m.zz - q;
  const double squared =
      (xx * xx + yy * yy + zz * zz) + 2.0 * (m.xy * m.xy + m.xz * m.xz + m.yz * m.yz);
  const double p = std::sqrt(squared / 6.0);
  const double determinant = xx * (yy * zz - m.yz * m.yz) - m.xy * (m.xy * zz - m.yz * m.xz) +
                             m.xz * (m.xy * m.yz - yy * m.xz);
  const double cube = 2.0 * p * p * p;
  if (!(cube > 0.0)) return {q, q, q};
  const double r = std::clamp(determinant / cube, -1.0, 1.0);
  const double c = 0.5 + trisected_cosine(1.0 + r);
  const double s = std::sqrt(std::max(0.0, 1.0 - c * c));
  constexpr double kRoot3 = 1.7320508075688772;
  const double largest = q + 2.0 * p * c;
  const double smallest = q - p * (c + kRoot3 * s);
  const double middle = std::clamp(3.0 * q - largest - smallest, smallest, largest);
  return {smallest, middle, largest};
}

Vec3d smallest_eigenvector(const Symmetric3& m, const Vec3d& values) noexcept {
  // Below this gap the cross products are rounding; the rotations are not.
  constexpr double kMinGap = 1e-5;
  if (!(values[1] - values[0] > kMinGap * values[2])) return eigen_symmetric3(m).vectors.col(0);
  const Vec3d a(m.xx - values[0], m.xy, m.xz);
  const Vec3d b(m.xy, m.yy - values[0], m.yz);
  const Vec3d c(m.xz, m.yz, m.zz - values[0]);
  Vec3d best = a.cross(b);
  double squared = best.squaredNorm();
  for (const Vec3d& other : {Vec3d(a.cross(c)), Vec3d(b.cross(c))}) {
    const double other_squared = other.squaredNorm();
    if (other_squared <= squared) continue;
    best = other;
    squared = other_squared;
  }
  return best / std::sqrt(squared);
}

}  // namespace grapnel
