#pragma once

#include "base/geometry.h"

namespace grapnel {

/// The features of two points with normals (Rusu 2009, eq. 3): f1 = angle about v, radians; f2 and
/// f3 = cosines; distance in metres.
struct PairFeature {
  double f1_rad = 0.0;
  double f2 = 0.0;
  double f3 = 0.0;
  double distance_m = 0.0;
  bool valid = false;  ///< false: coincident points, or the line along the source's normal
};

/// In double, as the kernels' measure. The same for (p, q) and (q, p) except for exact ties.
[[nodiscard]] PairFeature pair_feature(const Vec3d& p, const Vec3d& p_normal, const Vec3d& q,
                                       const Vec3d& q_normal) noexcept;

}  // namespace grapnel
