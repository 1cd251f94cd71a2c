#include "pipeline/coarse/plane_patches.h"

#include <algorithm>
#include <cmath>

#include "base/assert.h"
#include "base/math.h"
#include "pipeline/neighbours/symmetric3.h"

namespace grapnel {
namespace {

constexpr std::size_t kChecked = 512;
constexpr std::size_t kFewest = 12;
constexpr int kRefits = 2;
// Normals at a patch's rim lean toward the next face; by position they belong to it all the same.
constexpr double kCosRim = 0.5;
constexpr int kDirections = 48;

PlanePatches::Interval interval_of(const Surface& surface, std::span<const std::uint32_t> points,
                                   const Vec3d& direction) noexcept {
  PlanePatches::Interval interval = {1e30, -1e30};
  const Vec3f along = direction.cast<float>();
  for (const std::uint32_t i : points) {
    const auto at = static_cast<double>(along.dot(surface.point(i)));
    interval.low_m = std::min(interval.low_m, at);
    interval.high_m = std::max(interval.high_m, at);
  }
  return interval;
}

}  // namespace

void PlanePatches::reserve(Arena& arena, std::size_t max_points) {
  patch_of_ = arena.take<std::int8_t>(max_points);
  free_ = arena.take<std::uint32_t>(max_points);
}

bool PlanePatches::agrees(const Surface& surface, std::size_t i, const PlanePatch& plane,
                          double cos_normal) const noexcept {
  const double off_m = plane.normal.dot(surface.point(i).cast<double>()) - plane.offset_m;
  return std::fabs(off_m) <= thickness_m_ &&
         plane.normal.dot(surface.normal(i).cast<double>()) >= cos_normal;
}

PlanePatch PlanePatches::best_of(const Surface& surface, const PlanePatchParams& params,
                                 double cos_normal, Rng& rng) const noexcept {
  PlanePatch best;
  const std::size_t step = free_count_ / kChecked + 1;
  for (std::size_t trial = 0; trial < params.trials; ++trial) {
    const std::size_t i = free_[rng.below(static_cast<std::uint32_t>(free_count_))];
    if (!surface.has_normal(i)) continue;
    PlanePatch plane;
    plane.normal = surface.normal(i).cast<double>();
    plane.offset_m = plane.normal.dot(surface.point(i).cast<double>());
    for (std::size_t k = 0; k < free_count_; k += step) {
      if (agrees(surface, free_[k], plane, cos_normal)) plane.points += step;
    }
    if (plane.points > best.points) best = plane;
  }
  return best;
}

bool PlanePatches::fit(const Surface& surface, double cos_normal,
                       PlanePatch& plane) const noexcept {
  // Relative to one of the points, for the sums' sake.
  const Vec3d origin = surface.point(free_[0]).cast<double>();
  Vec3d sum = Vec3d::Zero();
  Vec3d side = Vec3d::Zero();
  Symmetric3 moments;
  std::size_t count = 0;
  for (std::size_t k = 0; k < free_count_; ++k) {
    const std::size_t i = free_[k];
    if (!agrees(surface, i, plane, cos_normal)) continue;
    const Vec3d p = surface.point(i).cast<double>() - origin;
    sum += p;
    side += surface.normal(i).cast<double>();
    moments.add(p.x(), p.y(), p.z());
    ++count;
  }
  if (count < kFewest) return false;
  const auto n = static_cast<double>(count);
  const Vec3d mean = sum / n;
  plane.normal = eigen_symmetric3(moments.over(n).about(mean)).vectors.col(0);
  if (plane.normal.dot(side) < 0.0) plane.normal = -plane.normal;
  plane.middle = origin + mean;
  plane.offset_m = plane.normal.dot(plane.middle);
  plane.points = count;
  return plane.normal.allFinite();
}

void PlanePatches::find(const Surface& surface, const PlanePatchParams& params, Rng rng) noexcept {
  GRAPNEL_ASSERT(surface.size <= patch_of_.size());
  patches_.clear();
  thickness_m_ = params.thickness_ratio * surface.spacing_m;
  const double cos_normal = math::cos(params.max_normal_angle_rad);
  free_count_ = 0;
  for (std::size_t i = 0; i < surface.size; ++i) {
    patch_of_[i] = -1;
    free_[free_count_++] = static_cast<std::uint32_t>(i);
  }
  const double fewest =
      std::max(static_cast<double>(kFewest), params.min_share * static_cast<double>(surface.size));
  while (!patches_.full() && static_cast<double>(free_count_) >= fewest) {
    PlanePatch plane = best_of(surface, params, cos_normal, rng);
    bool fits = true;
    for (int i = 0; fits && i < kRefits; ++i) fits = fit(surface, cos_normal, plane);
    if (!fits || static_cast<double>(plane.points) < fewest) break;
    const auto label = static_cast<std::int8_t>(patches_.size());
    patches_.push_back(plane);
    std::size_t left = 0;
    for (std::size_t k = 0; k < free_count_; ++k) {
      const std::uint32_t i = free_[k];
      if (agrees(surface, i, plane, kCosRim)) {
        patch_of_[i] = label;
      } else {
        free_[left++] = i;
      }
    }
    if (left == free_count_) break;
    free_count_ = left;
  }
}

PlanePatches::Interval PlanePatches::extent(const Surface& surface, std::size_t patch,
                                            const Vec3d& direction) const noexcept {
  Interval interval = {1e30, -1e30};
  const Vec3f along = direction.cast<float>();
  for (std::size_t i = 0; i < surface.size; ++i) {
    if (patch_of_[i] != static_cast<std::int8_t>(patch)) continue;
    const auto at = static_cast<double>(along.dot(surface.point(i)));
    interval.low_m = std::min(interval.low_m, at);
    interval.high_m = std::max(interval.high_m, at);
  }
  return interval;
}

PlanePatches::Rectangle PlanePatches::rectangle(const Surface& surface,
                                                std::size_t patch) noexcept {
  std::size_t count = 0;
  for (std::size_t i = 0; i < surface.size; ++i) {
    if (patch_of_[i] == static_cast<std::int8_t>(patch))
      free_[count++] = static_cast<std::uint32_t>(i);
  }
  const auto on = [&](const Vec3d& direction) {
    return interval_of(surface, free_.first(count), direction);
  };
  const Vec3d& normal = patches_[patch].normal;
  const Vec3d first = frame_about(normal).col(1);
  const Vec3d second = normal.cross(first);
  Rectangle best;
  double least_m2 = 1e30;
  for (int k = 0; k < kDirections; ++k) {
    const double turn_rad = 0.5 * math::kPi * k / kDirections;
    const Vec3d a = math::cos(turn_rad) * first + math::sin(turn_rad) * second;
    const Vec3d b = normal.cross(a);
    const Interval on_a = on(a);
    const Interval on_b = on(b);
    const double length_m = on_a.high_m - on_a.low_m;
    const double width_m = on_b.high_m - on_b.low_m;
    if (length_m * width_m >= least_m2) continue;
    least_m2 = length_m * width_m;
    best.middle = 0.5 * (on_a.low_m + on_a.high_m) * a + 0.5 * (on_b.low_m + on_b.high_m) * b +
                  patches_[patch].offset_m * normal;
    best.along = length_m >= width_m ? a : b;
    best.across = normal.cross(best.along);
    best.length_m = std::max(length_m, width_m);
    best.width_m = std::min(length_m, width_m);
  }
  return best;
}

}  // namespace grapnel
