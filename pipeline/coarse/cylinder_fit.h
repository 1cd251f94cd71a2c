#pragma once

#include <cstddef>

#include "base/geometry.h"
#include "base/rng.h"
#include "pipeline/surface.h"

namespace grapnel {

struct CylinderFitParams {
  std::size_t trials = 200;           ///< pairs of points tried
  double thickness_ratio = 0.6;       ///< half thickness of the wall, spacings
  double max_normal_angle_rad = 0.4;  ///< of a point's normal from the radius through it
  double min_share = 0.15;            ///< of all points, on the wall
};

/// The wall of a barrel, and how far the surface reaches along its axis.
struct Cylinder {
  Vec3d axis = Vec3d::UnitZ();   ///< unit
  Vec3d middle = Vec3d::Zero();  ///< the axis' point nearest to the wall's mean
  double radius_m = 0.0;
  double low_m = 0.0, high_m = 0.0;  ///< along the axis from `middle`: of all points within
  double arc_rad = 0.0;              ///< angle that the wall's points cover around the axis
  double rmse_m = 0.0;               ///< of the wall's points
  std::size_t points = 0;            ///< on the wall
};

/// The cylinder with the most points on its wall, seen from outside: of random pairs of points with
/// their normals (Schnabel, Wahl and Klein 2007); then the axis that the normals are least along,
/// and the circle across it with the least squares of distance. False when there is none.
/// O(points + trials × 512), no heap.
[[nodiscard]] bool fit_cylinder(const Surface& surface, const CylinderFitParams& params, Rng rng,
                                Cylinder& cylinder) noexcept;

}  // namespace grapnel
