#include "firmware_app/plane_fit.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstddef>

#include "base/rng.h"

namespace grapnel {
namespace {

constexpr int kStridePx = 4;
constexpr int kTrials = 64;
constexpr double kMinInlierShare = 0.3;
// A structured-light sensor's step at distance z is about 2.9 mm z² (1/8 px of disparity, 7.5 cm
// baseline); two steps and 2 mm for the belt's own unevenness still count as belt.
constexpr double kStepPerSquareMetre = 2.9e-3;
constexpr double kUnevennessM = 2e-3;

struct Sampler {
  ImageView<const std::uint16_t> depth;
  double metres_per_unit;
  Intrinsics intrinsics;

  /// False where there is no reading.
  bool point(int u, int v, Vec3d& p) const noexcept {
    const std::uint16_t count = depth.at(u, v);
    if (count == 0) return false;
    const double z = count * metres_per_unit;
    p = {(u - intrinsics.cx) / intrinsics.fx * z, (v - intrinsics.cy) / intrinsics.fy * z, z};
    return true;
  }
};

double tolerance_m(double z) noexcept { return kUnevennessM + 2.0 * kStepPerSquareMetre * z * z; }

/// Sums over the inliers of a plane; all readings when the plane is zero.
struct Moments {
  std::size_t readings = 0;
  std::size_t inliers = 0;
  Vec3d sum = Vec3d::Zero();
  Mat3d outer = Mat3d::Zero();

  Moments(const Sampler& sampler, const Vec3d& normal, double offset_m) noexcept {
    for (int v = 0; v < sampler.depth.height; v += kStridePx) {
      for (int u = 0; u < sampler.depth.width; u += kStridePx) {
        Vec3d p;
        if (!sampler.point(u, v, p)) continue;
        ++readings;
        if (std::abs(normal.dot(p) + offset_m) > tolerance_m(p.z())) continue;
        ++inliers;
        sum += p;
        outer += p * p.transpose();
      }
    }
  }
};

bool random_point(const Sampler& sampler, Rng& rng, Vec3d& p) noexcept {
  constexpr int kAttempts = 16;
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    const int u = static_cast<int>(rng.below(static_cast<std::uint32_t>(sampler.depth.width)));
    const int v = static_cast<int>(rng.below(static_cast<std::uint32_t>(sampler.depth.height)));
    if (sampler.point(u, v, p)) return true;
  }
  return false;
}

}  // namespace

FittedPlane fit_dominant_plane(ImageView<const std::uint16_t> depth, double metres_per_unit,
                               const Intrinsics& intrinsics) noexcept {
  const Sampler sampler{depth, metres_per_unit, intrinsics};
  FittedPlane best;
  std::size_t best_inliers = 0;
  Rng rng(1);
  for (int trial = 0; trial < kTrials; ++trial) {
    Vec3d a;
    Vec3d b;
    Vec3d c;
    if (!random_point(sampler, rng, a) || !random_point(sampler, rng, b) ||
        !random_point(sampler, rng, c)) {
      continue;
    }
    const Vec3d cross = (b - a).cross(c - a);
    if (cross.norm() < 1e-6) continue;
    const Vec3d normal = cross.normalized();
    const double offset_m = -normal.dot(a);
    const Moments moments(sampler, normal, offset_m);
    if (moments.inliers <= best_inliers) continue;
    best_inliers = moments.inliers;
    best.normal = normal;
    best.offset_m = offset_m;
  }
  if (best_inliers == 0) return best;
  // Twice: the first fit's plane is nearer than the three random points', so its inliers are
  // better.
  for (int pass = 0; pass < 2; ++pass) {
    const Moments moments(sampler, best.normal, best.offset_m);
    if (moments.inliers < 3) return {};
    const double count = static_cast<double>(moments.inliers);
    const Vec3d mean = moments.sum / count;
    const Mat3d covariance = moments.outer / count - mean * mean.transpose();
    const Eigen::SelfAdjointEigenSolver<Mat3d> eigen(covariance);
    best.normal = eigen.eigenvectors().col(0).normalized();
    best.offset_m = -best.normal.dot(mean);
    best.rms_m = std::sqrt(std::max(0.0, eigen.eigenvalues()(0)));
    best.inlier_share = count / static_cast<double>(moments.readings);
  }
  // Toward the camera: the origin lies on the positive side.
  if (best.offset_m < 0.0) {
    best.normal = -best.normal;
    best.offset_m = -best.offset_m;
  }
  best.found = best.inlier_share >= kMinInlierShare;
  return best;
}

}  // namespace grapnel
