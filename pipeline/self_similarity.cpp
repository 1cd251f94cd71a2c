#include "pipeline/self_similarity.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <span>
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
// Shifts along the model's axes to begin with, and the least that is left of one, in diameters: of
// ribs, rungs, a pattern that repeats.
constexpr std::array<double, 9> kShifts = {0.06, 0.08, 0.10, 0.12, 0.15, 0.18, 0.22, 0.26, 0.30};
constexpr double kLeastShift = 0.05;
constexpr double kLessBetween = 0.01;
// A model differs from its mirror image where they are this many diameters apart, over this share
// of its surface: less than that no reading of a part tells.
constexpr double kTold = 0.02;
constexpr float kAnywhere_m = 1e3F;
constexpr double kTelling = 0.004;

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

/// A model that is compared with itself, or its mirror image with it.
struct Likeness {
  const Surface& surface;
  const ClosestPointTable& table;
  Vec3d centre;
  double diameter_m = 0.0;
  Symmetry symmetry = Symmetry::None;
  bool mirror = false;

  [[nodiscard]] double distance_m(const Pose& a, const Pose& b) const {
    return displacement_m(nearest_equivalent(a, b, symmetry), b, centre, 0.5 * diameter_m);
  }
  /// Every rotation about the centre; of the mirror image behind the reflection in that point.
  [[nodiscard]] Pose motion(int i) const {
    Pose motion = Pose::Identity();
    motion.linear() = mirror ? Mat3d(-rotation_of(i)) : rotation_of(i);
    motion.translation() = centre - motion.linear() * centre;
    return motion;
  }
  /// The mirror image never stands still: it is not the model.
  [[nodiscard]] bool stands_still(const Pose& motion, double ratio) const {
    return !mirror && distance_m(motion, Pose::Identity()) < ratio * diameter_m;
  }
};

/// The motions to begin with, best first, far apart.
std::vector<Seed> find_seeds(const Likeness& likeness) {
  std::vector<Seed> seeds;
  for (int i = 0; i < kRotations; ++i) {
    Seed seed;
    seed.motion = likeness.motion(i);
    if (likeness.stands_still(seed.motion, 1.2 * kDistinct)) continue;
    seed.off = rate(likeness.surface, likeness.table, seed.motion, kFar * likeness.diameter_m);
    seeds.push_back(seed);
  }
  std::stable_sort(seeds.begin(), seeds.end(),
                   [](const Seed& a, const Seed& b) { return a.off < b.off; });
  std::vector<Seed> apart;
  for (const Seed& seed : seeds) {
    if (apart.size() == kSeeds) break;
    const bool near = std::any_of(apart.begin(), apart.end(), [&](const Seed& other) {
      return likeness.distance_m(seed.motion, other.motion) < 1.2 * kDistinct * likeness.diameter_m;
    });
    if (!near) apart.push_back(seed);
  }
  return apart;
}

/// The surface in memory of its own, and reflected in the origin: x -> -x, normals as well.
class Reflected {
 public:
  Reflected(const Reflected&) = delete;
  Reflected& operator=(const Reflected&) = delete;
  explicit Reflected(const Surface& surface) : surface_(surface) {
    std::span<float>* const planes[] = {&surface_.x,  &surface_.y,  &surface_.z,
                                        &surface_.nx, &surface_.ny, &surface_.nz};
    for (std::size_t k = 0; k < numbers_.size(); ++k) {
      numbers_[k].assign(planes[k]->begin(), planes[k]->end());
      for (float& number : numbers_[k]) number = -number;
      *planes[k] = numbers_[k];
    }
  }
  [[nodiscard]] const Surface& surface() const { return surface_; }

 private:
  Surface surface_;
  std::array<std::vector<float>, 6> numbers_;
};

/// From a motion of the surface to the same of the surface reflected in the origin, and back.
Pose after_reflection(Pose motion) {
  motion.linear() = -motion.linear();
  return motion;
}

/// Refines a motion by registering the model, or its mirror image, to the model.
class Refiner {
 public:
  explicit Refiner(const Likeness& likeness) : likeness_(likeness), icp_(params_of(likeness)) {
    if (likeness.mirror) reflected_.emplace(likeness.surface);
  }
  [[nodiscard]] Pose operator()(const Pose& motion) {
    // Refinement takes rotations alone.
    const Surface& moving = reflected_ ? reflected_->surface() : likeness_.surface;
    const Pose start = reflected_ ? after_reflection(motion) : motion;
    const Result<RefinedPose> refined =
        icp_.refine(moving, likeness_.surface, likeness_.table, start);
    if (!refined.ok()) return motion;
    const Pose& found = refined.value().target_from_source;
    return reflected_ ? after_reflection(found) : found;
  }

 private:
  static IcpParams params_of(const Likeness& likeness) {
    IcpParams params;
    params.max_points = 600;
    params.start_distance_ratio =
        std::max(4.0, 2.0 * kFar * likeness.diameter_m / likeness.surface.spacing_m);
    return params;
  }

  const Likeness& likeness_;
  std::optional<Reflected> reflected_;
  Icp icp_;
};

double share_of(const Likeness& likeness, const Pose& motion) {
  return shared_surface(likeness.surface, likeness.table, motion, kMeets * likeness.diameter_m);
}

/// Half way there the model meets itself less: what slides along itself, as a box along its sides,
/// is no repetition, and how far it can slide the predicted deviation says.
bool repeats(const Likeness& likeness, const Sibling& sibling) {
  Pose half = Pose::Identity();
  half.translation() = 0.5 * (sibling.motion * likeness.centre - likeness.centre);
  return share_of(likeness, half) < sibling.share - kLessBetween;
}

/// Adds where a motion leads, if most of the model meets itself there and nothing within `apart`
/// diameters does so already.
void add_sibling(const Likeness& likeness, const Pose& start, double apart, bool shift,
                 Refiner& refined, std::vector<Sibling>& siblings) {
  const Pose motion = refined(start);
  if (likeness.stands_still(motion, apart)) return;
  const Sibling sibling{motion, share_of(likeness, motion)};
  if (sibling.share < kLeastShare || (shift && !repeats(likeness, sibling))) return;
  const bool known = std::any_of(siblings.begin(), siblings.end(), [&](const Sibling& other) {
    return likeness.distance_m(motion, other.motion) < apart * likeness.diameter_m;
  });
  if (!known) siblings.push_back(sibling);
}

/// The best, as many as fit.
void find(const Likeness& likeness, FixedList<Sibling>& best) {
  std::vector<Sibling> siblings;
  Refiner refined(likeness);
  for (const Seed& seed : find_seeds(likeness)) {
    add_sibling(likeness, seed.motion, kDistinct, false, refined, siblings);
  }
  for (int axis = 0; axis < 3 && !likeness.mirror; ++axis) {
    for (const double shift : kShifts) {
      for (const double side : {-1.0, 1.0}) {
        Pose start = Pose::Identity();
        start.translation()[axis] = side * shift * likeness.diameter_m;
        add_sibling(likeness, start, kLeastShift, true, refined, siblings);
      }
    }
  }
  std::stable_sort(siblings.begin(), siblings.end(),
                   [](const Sibling& a, const Sibling& b) { return a.share > b.share; });
  best.clear();
  for (const Sibling& sibling : siblings) {
    if (!best.push_back(sibling)) break;
  }
}

/// Distance of a point from the fine model, metres. A model that was scanned in part ends
/// somewhere, and beside its ends nobody knows: there it is measured along the normals, and nought
/// where they disagree.
float gap_m(const FineModel& fine, const Vec3f& p, const Vec3f& normal) {
  const std::int32_t found = fine.table.closest(p, kAnywhere_m);
  if (found < 0) return fine.closed ? kAnywhere_m : 0.0F;
  const auto j = static_cast<std::size_t>(found);
  const Vec3f gap = p - fine.surface.point(j);
  if (fine.closed) return gap.norm();
  const Vec3f there = fine.surface.normal(j);
  return there.dot(normal) > kCosNormal ? std::fabs(there.dot(gap)) : 0.0F;
}

/// Share of the surface that a motion carries farther than `apart_m` away from it.
double differing_share(const FineModel& fine, const Pose& motion, double apart_m) {
  const Surface& surface = fine.surface;
  const Eigen::Matrix3f rotation = motion.linear().cast<float>();
  const Vec3f shift = motion.translation().cast<float>();
  // Between points of the model a surface is as far from the nearest one as they are apart.
  const auto limit_m = static_cast<float>(apart_m + surface.spacing_m);
  std::size_t differing = 0;
  for (std::size_t i = 0; i < surface.size; ++i) {
    const Vec3f p = rotation * surface.point(i) + shift;
    if (gap_m(fine, p, rotation * surface.normal(i)) > limit_m) ++differing;
  }
  return surface.size > 0 ? static_cast<double>(differing) / static_cast<double>(surface.size)
                          : 0.0;
}

}  // namespace

void find_siblings(const Surface& surface, const ClosestPointTable& table, const Vec3d& centre,
                   double diameter_m, Symmetry symmetry, FixedList<Sibling>& siblings) {
  find({surface, table, centre, diameter_m, symmetry, false}, siblings);
}

void find_mirrored_siblings(const FineModel& fine, const Surface& surface,
                            const ClosestPointTable& table, const Vec3d& centre, double diameter_m,
                            Symmetry symmetry, FixedList<Sibling>& siblings) {
  find({surface, table, centre, diameter_m, symmetry, true}, siblings);
  const bool own = std::any_of(siblings.begin(), siblings.end(), [&](const Sibling& sibling) {
    return differing_share(fine, sibling.motion, kTold * diameter_m) < kTelling;
  });
  if (own) siblings.clear();
}

}  // namespace grapnel
