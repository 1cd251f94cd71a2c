#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "base/arena.h"
#include "base/fixed_list.h"
#include "base/geometry.h"
#include "base/rng.h"
#include "pipeline/surface.h"

namespace grapnel {

/// A flat part of a surface: n·p = offset, n on the side of the points' own normals.
struct PlanePatch {
  Vec3d normal = Vec3d::Zero();
  double offset_m = 0.0;
  Vec3d middle = Vec3d::Zero();  ///< mean of its points
  std::size_t points = 0;
};

struct PlanePatchParams {
  std::size_t trials = 48;            ///< points tried for each plane
  double thickness_ratio = 0.6;       ///< half thickness, spacings
  double max_normal_angle_rad = 0.5;  ///< of a point's normal from the plane's
  double min_share = 0.05;            ///< of all points, of a plane
};

/// Planes of a surface, largest first: of random points with their normals the one that most points
/// agree with (Fischler and Bolles 1981 with one point a sample, as points are oriented), fitted to
/// these by least squares; then the same among the rest. A fixed number of steps, no heap.
class PlanePatches {
 public:
  static constexpr std::size_t kMost = 8;

  void reserve(Arena& arena, std::size_t max_points);
  /// O(planes × (points + trials × 512)).
  void find(const Surface& surface, const PlanePatchParams& params, Rng rng) noexcept;

  [[nodiscard]] std::span<const PlanePatch> patches() const noexcept { return patches_.span(); }

  struct Interval {
    double low_m = 0.0, high_m = 0.0;
  };
  /// Where the points of a patch lie along a direction.
  [[nodiscard]] Interval extent(const Surface& surface, std::size_t patch,
                                const Vec3d& direction) const noexcept;

  /// The rectangle around a patch with the least area, of 48 directions.
  struct Rectangle {
    Vec3d middle = Vec3d::Zero();
    Vec3d along = Vec3d::UnitX();   ///< its longer sides
    Vec3d across = Vec3d::UnitY();  ///< normal × along
    double length_m = 0.0, width_m = 0.0;
  };
  [[nodiscard]] Rectangle rectangle(const Surface& surface, std::size_t patch) noexcept;

 private:
  [[nodiscard]] bool agrees(const Surface& surface, std::size_t i, const PlanePatch& plane,
                            double cos_normal) const noexcept;
  /// Fits to the free points that agree; false when they are too few.
  bool fit(const Surface& surface, double cos_normal, PlanePatch& plane) const noexcept;
  [[nodiscard]] PlanePatch best_of(const Surface& surface, const PlanePatchParams& params,
                                   double cos_normal, Rng& rng) const noexcept;

  InlineList<PlanePatch, kMost> patches_;
  std::span<std::int8_t> patch_of_;  // of each point, -1 = none
  std::span<std::uint32_t> free_;    // points of no patch yet; after the search, scratch
  std::size_t free_count_ = 0;
  double thickness_m_ = 0.0;
};

}  // namespace grapnel
