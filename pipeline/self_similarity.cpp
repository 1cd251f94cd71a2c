#include "pipeline/self_similarity.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "base/math.h"
#include "pipeline/coarse/hypothesis_list.h"
#include "pipeline/refine/icp.h"

namespace grapnel {
namespace {

constexpr int kRotations = 4000;
constexpr std::size_t kRatedPoints = 96;
constexpr std::size_t kSeeds = 24;
// In diameters: a seed's deviation that counts as one, points that meet, motions that differ.
constexpr double kFar = 0.06;
constexpr double kMeets = 0.012;
constexpr double kDistinct = 0.15;
constexpr float kCosNormal = 0.8F;
constexpr double kLeastShare = 0.6;

struct Seed {
  Pose motion = Pose::Identity();
  double off = 0.0;  ///< mean squared deviation, 0…1
};

Mat3d rotation_of(int i) {
  constexpr double kPhi = 1.4142135623730951;
  constexpr double kPsi = 1.5337511687552043;
  const double s = i + 0.5;
  const double r = std::sqrt(s / kRotations);
  const double rest = std::sqrt(1.0 - s / kRotations);
  const double a = 2.0 * math::kPi * s / kPhi;
  const double b = 2.0 * math::kPi * s / kPsi;
  const Eigen::Quaterniond q(rest * math::cos(b), r * math::sin(a), r * math::cos(a),
                             rest * math::sin(b));
  return q.normalized().toRotationMatrix();
}

double distance_m(const Pose& a, const Pose& b, const Vec3d& centre, double diameter_m,
                  Symmetry symmetry) {
  return displacement_m(nearest_equivalent(a, b, symmetry), b, centre, 0.5 * diameter_m);
}

double rate(const Surface& surface, const ClosestPointTable& table, const Pose& motion,
            double far_m) {
  const Eigen::Matrix3f rotation = motion.linear().cast<float>();
  const Vec3f shift = motion.translation().cast<float>();
  const std::size_t step = std::max<std::size_t>(1, surface.size / kRatedPoints);
  double off = 0.0;
  double count = 0.0;
  for (std::size_t i = 0; i < surface.size; i += step) {
    const Vec3f p = rotation * surface.point(i) + shift;
    const std::int32_t found = table.nearby(p);
    double square = 1.0;
    if (found >= 0) {
      const auto gap =
          static_cast<double>((surface.point(static_cast<std::size_t>(found)) - p).norm());
      square = std::min(1.0, gap * gap / (far_m * far_m));
    }
    off += square;
    count += 1.0;
  }
  return count > 0.0 ? off / count : 1.0;
}

double shared_surface(const Surface& surface, const ClosestPointTable& table, const Pose& motion,
                      double meets_m) {
  const Eigen::Matrix3f rotation = motion.linear().cast<float>();
  const Vec3f shift = motion.translation().cast<float>();
  std::size_t met = 0;
  for (std::size_t i = 0; i < surface.size; ++i) {
    const Vec3f p = rotation * surface.point(i) + shift;
    const std::int32_t found = table.closest(p, static_cast<float>(4.0 * meets_m));
    if (found < 0) continue;
    const auto j = static_cast<std::size_t>(found);
    const Vec3f normal = rotation * surface.normal(i);
    const float off = surface.normal(j).dot(p - surface.point(j));
    if (std::fabs(off) < static_cast<float>(meets_m) &&
        surface.normal(j).dot(normal) > kCosNormal) {
      ++met;
    }
  }
  return surface.size > 0 ? static_cast<double>(met) / static_cast<double>(surface.size) : 0.0;
}

}  // namespace

void find_siblings(const Surface& surface, const ClosestPointTable& table, const Vec3d& centre,
                   double diameter_m, Symmetry symmetry, FixedList<Sibling>& siblings) {
  siblings.clear();
  std::vector<Seed> seeds;
  for (int i = 0; i < kRotations; ++i) {
    Seed seed;
    seed.motion.linear() = rotation_of(i);
    seed.motion.translation() = centre - seed.motion.linear() * centre;
    if (distance_m(seed.motion, Pose::Identity(), centre, diameter_m, symmetry) <
        1.2 * kDistinct * diameter_m) {
      continue;
    }
    seed.off = rate(surface, table, seed.motion, kFar * diameter_m);
    seeds.push_back(seed);
  }
  std::stable_sort(seeds.begin(), seeds.end(),
                   [](const Seed& a, const Seed& b) { return a.off < b.off; });
  std::vector<Seed> apart;
  for (const Seed& seed : seeds) {
    if (apart.size() == kSeeds) break;
    const bool near = std::any_of(apart.begin(), apart.end(), [&](const Seed& other) {
      return distance_m(seed.motion, other.motion, centre, diameter_m, symmetry) <
             1.2 * kDistinct * diameter_m;
    });
    if (!near) apart.push_back(seed);
  }
  IcpParams params;
  params.max_points = 600;
  params.start_distance_ratio = std::max(4.0, 2.0 * kFar * diameter_m / surface.spacing_m);
  Icp icp(params);
  for (const Seed& seed : apart) {
    const Result<RefinedPose> refined = icp.refine(surface, surface, table, seed.motion);
    const Pose motion = refined.ok() ? refined.value().target_from_source : seed.motion;
    const Sibling sibling{motion, shared_surface(surface, table, motion, kMeets * diameter_m)};
    if (sibling.share < kLeastShare) continue;
    const auto alike = [&](const Pose& other) {
      return distance_m(motion, other, centre, diameter_m, symmetry) < kDistinct * diameter_m;
    };
    if (alike(Pose::Identity())) continue;
    if (std::any_of(siblings.begin(), siblings.end(),
                    [&](const Sibling& other) { return alike(other.motion); })) {
      continue;
    }
    if (!siblings.push_back(sibling)) break;
  }
  std::stable_sort(siblings.begin(), siblings.end(),
                   [](const Sibling& a, const Sibling& b) { return a.share > b.share; });
}

}  // namespace grapnel
