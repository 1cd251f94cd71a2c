#include "pipeline/judge/overlap_information.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "pipeline/refine/normal_equations.h"

namespace grapnel {
namespace {

// Normals farther apart than 45 degrees are not of one surface.
constexpr float kCosNormal = 0.7F;
// A direction keeps at least this share of what the strongest has, so that an inverse exists.
constexpr double kLeastShare = 1e-8;

/// Sums over the matched points, about `centre`.
struct Sums {
  double upper[21] = {};  ///< of the information, row by row
  Vec3d arms = Vec3d::Zero();
  Mat3d arm_products = Mat3d::Zero();
  double disagreement = 0.0;  ///< Σ (1 - cosine between partners' normals)
  std::size_t points = 0;

  void add(const Vec3d& arm, const Vec3d& normal, double cosine) noexcept {
    const Vec3d turn = arm.cross(normal);
    const double row[6] = {normal.x(), normal.y(), normal.z(), turn.x(), turn.y(), turn.z()};
    int k = 0;
    for (int a = 0; a < 6; ++a) {
      for (int b = a; b < 6; ++b) upper[k++] += row[a] * row[b];
    }
    arms += arm;
    arm_products += arm * arm.transpose();
    disagreement += 1.0 - cosine;
    ++points;
  }

  [[nodiscard]] Mat6d information() const noexcept {
    Mat6d full;
    int k = 0;
    for (int a = 0; a < 6; ++a) {
      for (int b = a; b < 6; ++b) full(a, b) = full(b, a) = upper[k++];
    }
    return full;
  }

  /// What a unit variance of the normals adds to the information: with M = [1, -skew(arm)], the
  /// point's shift by the six motions, and the row Mᵀ n of a unit normal n it is Σ (M - n rowᵀ)ᵀ
  /// (M - n rowᵀ) = Σ Mᵀ M - Σ row rowᵀ.
  [[nodiscard]] Mat6d per_variance() const noexcept {
    Mat6d moves;
    moves.topLeftCorner<3, 3>() = static_cast<double>(points) * Mat3d::Identity();
    moves.topRightCorner<3, 3>() = -skew(arms);
    moves.bottomLeftCorner<3, 3>() = skew(arms);
    moves.bottomRightCorner<3, 3>() = arm_products.trace() * Mat3d::Identity() - arm_products;
    return moves - information();
  }
};

/// `information` without what noise adds; no eigenvalue below kLeastShare of the largest, angles
/// measured by the shift of a point one mean arm away.
Mat6d without_noise(const Sums& sums) noexcept {
  const auto count = static_cast<double>(sums.points);
  const double arm_m = std::max(std::sqrt(sums.arm_products.trace() / count), 1e-9);
  // Two unit normals, each off by σ about two axes, differ by |a - b|² = 2 (1 - cos) = 4 σ².
  const double variance = 0.5 * sums.disagreement / count;
  Vec6d scale;
  scale << 1.0, 1.0, 1.0, 1.0 / arm_m, 1.0 / arm_m, 1.0 / arm_m;
  const Mat6d scaled = scale.asDiagonal() * (sums.information() - variance * sums.per_variance()) *
                       scale.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Mat6d> solver(scaled);
  const double least = kLeastShare * std::max(solver.eigenvalues()[5], 1e-12);
  const Mat6d kept = solver.eigenvectors() * solver.eigenvalues().cwiseMax(least).asDiagonal() *
                     solver.eigenvectors().transpose();
  const Vec6d back = scale.cwiseInverse();
  return back.asDiagonal() * kept * back.asDiagonal();
}

}  // namespace

Mat6d overlap_information(const Surface& moved, const OverlapView& fixed,
                          const Pose& fixed_from_moved, double reach_m) noexcept {
  const Eigen::Matrix3f rotation = fixed_from_moved.linear().cast<float>();
  const Vec3f shift = fixed_from_moved.translation().cast<float>();
  const Vec3d centre = fixed_from_moved * centroid(moved);
  Sums sums;
  for (std::size_t i = 0; i < moved.size; ++i) {
    if (!moved.has_normal(i)) continue;
    const Vec3f p = rotation * moved.point(i) + shift;
    const std::int32_t found = fixed.table->closest(p, static_cast<float>(reach_m));
    if (found < 0 || !fixed.fine->has_normal(static_cast<std::size_t>(found))) continue;
    const Vec3f normal = fixed.fine->normal(static_cast<std::size_t>(found));
    const float cosine = normal.dot(rotation * moved.normal(i));
    if (cosine < kCosNormal) continue;
    sums.add(p.cast<double>() - centre, normal.cast<double>(), static_cast<double>(cosine));
  }
  if (sums.points == 0) return Mat6d::Zero();
  Mat6d centre_from_origin = Mat6d::Identity();
  centre_from_origin.topRightCorner<3, 3>() = -skew(centre);
  return centre_from_origin.transpose() * without_noise(sums) * centre_from_origin;
}

}  // namespace grapnel
