#include "pipeline/size_estimator.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "pipeline/coarse/cylinder_fit.h"

namespace grapnel {
namespace {

using Interval = PlanePatches::Interval;

constexpr double kCosSame = 0.96;           // 16 degrees
constexpr double kSinPerpendicular = 0.25;  // 14 degrees from a right angle
// Of all points, on the faces of a box or on the wall and lids of a barrel.
constexpr double kLeastExplained = 0.7;
// A wall seen over less than 70 degrees might be any bulge.
constexpr double kLeastArc_rad = 1.2;
// A barrel's wall is no worse than this, spacings.
constexpr double kRoughest = 0.3;
// An object ends up to a spacing beyond its last sample; a structured-light camera's outlines swell
// by about as much as that loses. What is left is uniform within one, at each of two ends.
constexpr double kEndSigma = 0.4082;  // spacings

Interval extent_of(const Surface& object, const Vec3d& direction) noexcept {
  Interval interval = {1e30, -1e30};
  const Vec3f along = direction.cast<float>();
  for (std::size_t i = 0; i < object.size; ++i) {
    const auto at = static_cast<double>(along.dot(object.point(i)));
    interval.low_m = std::min(interval.low_m, at);
    interval.high_m = std::max(interval.high_m, at);
  }
  return interval;
}

/// A box's axes, and how many faces lie across them.
struct Axes {
  std::array<Vec3d, 3> direction;  // along, across, up
  int faces = 0;
};

Axes axes_of(PlanePatches& planes, const Surface& object, const Ground& ground) noexcept {
  Axes axes;
  const auto patches = planes.patches();
  Vec3d up = patches[0].normal;
  if (ground.known()) up = ground.normal;
  for (const PlanePatch& patch : patches) {
    if (ground.known() && patch.normal.dot(up) > kCosSame) {
      up = patch.normal;
      break;
    }
  }
  Vec3d along = Vec3d::Zero();
  for (const PlanePatch& patch : patches) {
    if (std::fabs(patch.normal.dot(up)) > kSinPerpendicular) continue;
    along = (patch.normal - patch.normal.dot(up) * up).normalized();
    break;
  }
  if (along.squaredNorm() < 0.5) {
    const Vec3d side = planes.rectangle(object, 0).along;
    along = (side - side.dot(up) * up).normalized();
  }
  axes.direction = {along, up.cross(along), up};
  for (const PlanePatch& patch : patches) {
    double nearest = 0.0;
    for (const Vec3d& direction : axes.direction) {
      nearest = std::max(nearest, std::fabs(direction.dot(patch.normal)));
    }
    if (nearest > kCosSame) ++axes.faces;
  }
  return axes;
}

}  // namespace

const char* shape_name(SizeEstimate::Shape shape) noexcept {
  switch (shape) {
    case SizeEstimate::Shape::Box:
      return "box";
    case SizeEstimate::Shape::Barrel:
      return "barrel";
    case SizeEstimate::Shape::None:
      return "none";
  }
  return "none";
}

SizeEstimate SizeEstimator::box(const Surface& object, const Ground& ground) noexcept {
  SizeEstimate estimate;
  if (planes_.patches().empty()) return estimate;
  const Axes axes = axes_of(planes_, object, ground);
  std::size_t explained = 0;
  for (const PlanePatch& patch : planes_.patches()) {
    for (const Vec3d& direction : axes.direction) {
      if (std::fabs(direction.dot(patch.normal)) > kCosSame) explained += patch.points;
    }
  }
  if (static_cast<double>(explained) < kLeastExplained * static_cast<double>(object.size)) {
    return estimate;
  }
  std::array<double, 3> size_m{};
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3d& direction = axes.direction[k];
    Interval interval = extent_of(object, direction);
    bool ends = k < 2;  // both ends of a side across the view are seen as its outline
    for (const PlanePatch& patch : planes_.patches()) {
      const double cosine = direction.dot(patch.normal);
      if (cosine > kCosSame) interval.high_m = direction.dot(patch.middle);
      if (cosine < -kCosSame) interval.low_m = direction.dot(patch.middle);
    }
    if (k == 2 && ground.known()) {
      // Along the ground's own normal from the middle of the top down to it.
      const double top_m = interval.high_m - direction.dot(planes_.patches()[0].middle);
      const Vec3d top = planes_.patches()[0].middle + top_m * direction;
      interval.high_m = ground.height_m(top);
      interval.low_m = 0.0;
      ends = true;
    }
    if (k == 2 && !ground.known()) ends = axes.faces > 1;
    size_m[k] = ends ? interval.high_m - interval.low_m : 0.0;
  }
  if (size_m[0] < size_m[1]) std::swap(size_m[0], size_m[1]);
  estimate.shape = SizeEstimate::Shape::Box;
  estimate.size_m = Vec3d(size_m[0], size_m[1], size_m[2]);
  estimate.sigma_m = kEndSigma * object.spacing_m;
  return estimate;
}

SizeEstimate SizeEstimator::estimate(const Surface& object, const Ground& ground,
                                     Rng rng) noexcept {
  planes_.find(object, {}, rng.split(1));
  std::size_t flat = 0;
  for (const PlanePatch& patch : planes_.patches()) flat += patch.points;
  Cylinder wall;
  if (fit_cylinder(object, {}, rng.split(2), wall) && wall.arc_rad > kLeastArc_rad &&
      wall.rmse_m < kRoughest * object.spacing_m) {
    // Strips of a wall pass for planes, but for one face a barrel has its lid at the most.
    std::size_t lid = 0;
    for (const PlanePatch& patch : planes_.patches()) {
      if (std::fabs(patch.normal.dot(wall.axis)) > kCosSame) lid = std::max(lid, patch.points);
    }
    const double share = static_cast<double>(wall.points + lid) / static_cast<double>(object.size);
    if (share > kLeastExplained && wall.points + lid > flat) {
      SizeEstimate estimate;
      estimate.shape = SizeEstimate::Shape::Barrel;
      double length_m = wall.high_m - wall.low_m;
      if (ground.known() && std::fabs(wall.axis.dot(ground.normal)) > kCosSame) {
        const Vec3d end =
            wall.middle +
            (wall.axis.dot(ground.normal) > 0.0 ? wall.high_m : wall.low_m) * wall.axis;
        length_m = ground.height_m(end);
      }
      estimate.size_m = Vec3d(2.0 * wall.radius_m, 2.0 * wall.radius_m, length_m);
      estimate.sigma_m = kEndSigma * object.spacing_m;
      return estimate;
    }
  }
  return box(object, ground);
}

}  // namespace grapnel
