#include "pipeline/coarse/cylinder_fit.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>

#include "base/math.h"
#include "pipeline/neighbours/symmetric3.h"

namespace grapnel {
namespace {

constexpr std::size_t kChecked = 512;
constexpr std::size_t kFewest = 20;
// Normals of a pair differ by more than 12 degrees.
constexpr double kLeastSine = 0.2;
constexpr double kLeastRadius = 2.0;  // spacings
constexpr int kRefits = 3;
constexpr int kCircleSteps = 4;
constexpr std::size_t kSectors = 72;
// Around a wall the points lie as their normals turn. Of two faces of a box, between which a
// cylinder fits too, the normals are two: shares of points whose sector of 15 degrees differs.
constexpr std::size_t kTurnSectors = 24;
constexpr double kMostElsewhere = 0.5;
// A point within the wall, or on a lid.
constexpr double kWithin = 1.1;  // radii

struct Wall {
  double thickness_m = 0.0;
  double cos_normal = 0.0;

  [[nodiscard]] bool holds(const Surface& surface, std::size_t i,
                           const Cylinder& cylinder) const noexcept {
    const Vec3d from_middle = surface.point(i).cast<double>() - cylinder.middle;
    const Vec3d radial = from_middle - from_middle.dot(cylinder.axis) * cylinder.axis;
    const double distance_m = radial.norm();
    return std::fabs(distance_m - cylinder.radius_m) <= thickness_m &&
           radial.dot(surface.normal(i).cast<double>()) >= cos_normal * distance_m;
  }
};

/// The cylinder through two oriented points; false when they don't make one.
bool through(const Surface& surface, std::size_t i, std::size_t j, Cylinder& cylinder) noexcept {
  const Vec3d n = surface.normal(i).cast<double>();
  const Vec3d m = surface.normal(j).cast<double>();
  const Vec3d axis = n.cross(m);
  if (axis.norm() < kLeastSine) return false;
  cylinder.axis = axis.normalized();
  const Vec3d p = surface.point(i).cast<double>();
  const Vec3d q = surface.point(j).cast<double>();
  const Vec3d turn = n - m;
  // From the middle outward both points lie one radius along their normals.
  cylinder.radius_m = (p - q).dot(turn) / turn.squaredNorm();
  cylinder.middle = 0.5 * (p + q - cylinder.radius_m * (n + m));
  return cylinder.radius_m > kLeastRadius * surface.spacing_m;
}

Cylinder best_pair(const Surface& surface, const CylinderFitParams& params, const Wall& wall,
                   Rng& rng) noexcept {
  Cylinder best;
  const auto count = static_cast<std::uint32_t>(surface.size);
  const std::size_t step = surface.size / kChecked + 1;
  for (std::size_t trial = 0; trial < params.trials; ++trial) {
    Cylinder cylinder;
    if (!through(surface, rng.below(count), rng.below(count), cylinder)) continue;
    for (std::size_t i = 0; i < surface.size; i += step) {
      if (wall.holds(surface, i, cylinder)) cylinder.points += step;
    }
    if (cylinder.points > best.points) best = cylinder;
  }
  return best;
}

/// The direction that the wall's normals are least along, and the mean of its points.
bool refit_axis(const Surface& surface, const Wall& wall, Cylinder& cylinder) noexcept {
  Symmetric3 normals;
  Vec3d sum = Vec3d::Zero();
  std::size_t count = 0;
  for (std::size_t i = 0; i < surface.size; ++i) {
    if (!wall.holds(surface, i, cylinder)) continue;
    const Vec3d n = surface.normal(i).cast<double>();
    normals.add(n.x(), n.y(), n.z());
    sum += surface.point(i).cast<double>();
    ++count;
  }
  cylinder.points = count;
  if (count < kFewest) return false;
  const Vec3d axis = eigen_symmetric3(normals).vectors.col(0);
  cylinder.axis = axis.dot(cylinder.axis) < 0.0 ? Vec3d(-axis) : axis;
  const Vec3d mean = sum / static_cast<double>(count);
  cylinder.middle += (mean - cylinder.middle).dot(cylinder.axis) * cylinder.axis;
  return cylinder.axis.allFinite();
}

/// Gauss and Newton over middle and radius: the points' distances from the wall.
bool refit_circle(const Surface& surface, const Wall& wall, Cylinder& cylinder) noexcept {
  const Mat3d frame = frame_about(cylinder.axis);
  const Vec3d a = frame.col(1);
  const Vec3d b = frame.col(2);
  for (int step = 0; step < kCircleSteps; ++step) {
    Mat3d left = Mat3d::Zero();
    Vec3d right = Vec3d::Zero();
    double square_m2 = 0.0;
    std::size_t count = 0;
    for (std::size_t i = 0; i < surface.size; ++i) {
      if (!wall.holds(surface, i, cylinder)) continue;
      const Vec3d from_middle = surface.point(i).cast<double>() - cylinder.middle;
      const double u = a.dot(from_middle);
      const double v = b.dot(from_middle);
      const double distance_m = std::sqrt(u * u + v * v);
      const double off_m = distance_m - cylinder.radius_m;
      const Vec3d row(-u / distance_m, -v / distance_m, -1.0);
      left += row * row.transpose();
      right += off_m * row;
      square_m2 += off_m * off_m;
      ++count;
    }
    cylinder.points = count;
    if (count < kFewest) return false;
    cylinder.rmse_m = std::sqrt(square_m2 / static_cast<double>(count));
    const Vec3d change = -left.ldlt().solve(right);
    if (!change.allFinite() || change.norm() > cylinder.radius_m) return false;
    cylinder.middle += change.x() * a + change.y() * b;
    cylinder.radius_m += change.z();
    if (!(cylinder.radius_m > 0.0)) return false;
  }
  return true;
}

std::size_t sector_of(double u, double v, std::size_t sectors) noexcept {
  const double share = math::atan2(v, u) / (2.0 * math::kPi) + 0.5;
  return std::min(sectors - 1, static_cast<std::size_t>(share * static_cast<double>(sectors)));
}

/// Angle that the wall's points cover, and where all points within it lie along the axis. False
/// when the normals don't turn around it.
bool measure(const Surface& surface, const Wall& wall, Cylinder& cylinder) noexcept {
  const Mat3d frame = frame_about(cylinder.axis);
  const Vec3d a = frame.col(1);
  const Vec3d b = frame.col(2);
  std::array<bool, kSectors> seen{};
  std::array<double, kTurnSectors> excess{};  // points less normals of a direction
  cylinder.low_m = 1e30;
  cylinder.high_m = -1e30;
  for (std::size_t i = 0; i < surface.size; ++i) {
    const Vec3d from_middle = surface.point(i).cast<double>() - cylinder.middle;
    const double along_m = from_middle.dot(cylinder.axis);
    const double u = a.dot(from_middle);
    const double v = b.dot(from_middle);
    const double reach_m = kWithin * cylinder.radius_m;
    if (u * u + v * v > reach_m * reach_m) continue;
    cylinder.low_m = std::min(cylinder.low_m, along_m);
    cylinder.high_m = std::max(cylinder.high_m, along_m);
    if (!wall.holds(surface, i, cylinder)) continue;
    seen[sector_of(u, v, kSectors)] = true;
    const Vec3d n = surface.normal(i).cast<double>();
    excess[sector_of(u, v, kTurnSectors)] += 1.0;
    excess[sector_of(a.dot(n), b.dot(n), kTurnSectors)] -= 1.0;
  }
  const auto sectors = std::count(seen.begin(), seen.end(), true);
  cylinder.arc_rad = 2.0 * math::kPi * static_cast<double>(sectors) / kSectors;
  double elsewhere = 0.0;
  for (const double points : excess) elsewhere += 0.5 * std::fabs(points);
  return elsewhere <= kMostElsewhere * static_cast<double>(cylinder.points);
}

}  // namespace

bool fit_cylinder(const Surface& surface, const CylinderFitParams& params, Rng rng,
                  Cylinder& cylinder) noexcept {
  if (surface.size < kFewest) return false;
  const Wall wall = {params.thickness_ratio * surface.spacing_m,
                     math::cos(params.max_normal_angle_rad)};
  Cylinder best = best_pair(surface, params, wall, rng);
  if (best.points < kFewest) return false;
  for (int i = 0; i < kRefits; ++i) {
    if (!refit_axis(surface, wall, best) || !refit_circle(surface, wall, best)) return false;
  }
  if (static_cast<double>(best.points) < params.min_share * static_cast<double>(surface.size)) {
    return false;
  }
  if (!measure(surface, wall, best)) return false;
  cylinder = best;
  return true;
}

}  // namespace grapnel
