#include "pipeline/descriptors/pair_feature.h"

#include <cmath>

#include "base/math.h"

namespace grapnel {

PairFeature pair_feature(const Vec3d& p, const Vec3d& p_normal, const Vec3d& q,
                         const Vec3d& q_normal) noexcept {
  PairFeature feature;
  const Vec3d line = q - p;
  feature.distance_m = line.norm();
  if (feature.distance_m == 0.0) return feature;
  const double cos_p = p_normal.dot(line) / feature.distance_m;
  const double cos_q = q_normal.dot(line) / feature.distance_m;
  const bool from_q = std::fabs(cos_p) < std::fabs(cos_q);
  const Vec3d& u = from_q ? q_normal : p_normal;
  const Vec3d& target = from_q ? p_normal : q_normal;
  const Vec3d across = from_q ? Vec3d((-line).cross(u)) : Vec3d(line.cross(u));
  const double length = across.norm();
  if (length == 0.0) return feature;
  const Vec3d v = across / length;
  const Vec3d w = u.cross(v);
  feature.f1_rad = math::atan2(w.dot(target), u.dot(target));
  feature.f2 = v.dot(target);
  feature.f3 = from_q ? -cos_q : cos_p;
  feature.valid = true;
  return feature;
}

}  // namespace grapnel
