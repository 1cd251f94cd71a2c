#include "pipeline/reject/distance.h"

#include <algorithm>
#include <array>

namespace grapnel {

FieldTable distance_rejector_fields() noexcept {
  static constexpr std::array kFields = {
      number_field<&DistanceRejectorParams::max_distance>("max_distance", "", 0.0, 1e9,
                                                          "pairs as far or farther are dropped"),
  };
  return kFields;
}

Status DistanceRejector::reject(const PairView&, Correspondences& correspondences, Rng&) noexcept {
  const auto limit = static_cast<float>(params_.max_distance);
  const Correspondence* kept =
      std::remove_if(correspondences.begin(), correspondences.end(),
                     [limit](const Correspondence& c) { return !(c.distance < limit); });
  correspondences.resize(static_cast<std::size_t>(kept - correspondences.begin()));
  return {};
}

}  // namespace grapnel
