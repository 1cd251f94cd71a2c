#include "pipeline/reject/surface_normal.h"

#include <algorithm>
#include <array>

#include "pipeline/reject/ends.h"

namespace grapnel {

FieldTable surface_normal_rejector_fields() noexcept {
  static constexpr std::array kFields = {
      number_field<&SurfaceNormalRejectorParams::min_cos>(
          "min_cos", "", -1.0, 1.0, "cosine between the ends' normals; pairs at or below go"),
  };
  return kFields;
}

Status SurfaceNormalRejector::reject(const PairView& pair, Correspondences& correspondences,
                                     Rng&) noexcept {
  const auto limit = static_cast<float>(params_.min_cos);
  const auto disagrees = [&](const Correspondence& c) {
    const std::size_t s = source_point(pair, c);
    const std::size_t t = target_point(pair, c);
    if (!pair.source->has_normal(s) || !pair.target->has_normal(t)) return true;
    return !(pair.source->normal(s).dot(pair.target->normal(t)) > limit);
  };
  const Correspondence* kept =
      std::remove_if(correspondences.begin(), correspondences.end(), disagrees);
  correspondences.resize(static_cast<std::size_t>(kept - correspondences.begin()));
  return {};
}

}  // namespace grapnel
