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

}  // namespace grapnel
