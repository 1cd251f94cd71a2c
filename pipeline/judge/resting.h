#pragma once

#include "base/geometry.h"
#include "pipeline/preprocess/plane_search.h"
#include "pipeline/surface.h"

namespace grapnel {

/// How a part at a pose would rest on a plane.
struct Resting {
  double lowest_m = 0.0;   ///< signed height of its lowest point above the plane
  double highest_m = 0.0;  ///< and of its highest
  double support_m = 0.0;  ///< how far its centre stands inside what it rests on; negative = tips
};

/// Looks at the points within 2 % of the diameter above the lowest one: the part stands when its
/// centre, seen along the plane's normal, lies inside their convex hull. A box leaning by more than
/// some five degrees rests on an edge and does not. O(points).
[[nodiscard]] Resting rest_on(const DepthPlane& plane, const Surface& model,
                              const Pose& camera_from_model, const Vec3d& centre,
                              double diameter_m) noexcept;

}  // namespace grapnel
