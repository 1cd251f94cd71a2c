#include "pipeline/reject/one_to_one.h"

#include <algorithm>

namespace grapnel {

FieldTable one_to_one_rejector_fields() noexcept { return {}; }

void OneToOneRejector::reserve(Arena& arena, const Limits& limits) {
  nearest_ = arena.take<std::int32_t>(limits.max_keypoints);
}

Status OneToOneRejector::reject(const PairView&, Correspondences& correspondences, Rng&) noexcept {
  std::ranges::fill(nearest_, -1);
  for (std::size_t i = 0; i < correspondences.size(); ++i) {
    const auto target = static_cast<std::size_t>(correspondences[i].target);
    if (target >= nearest_.size()) {
      return Error{Code::CapacityExceeded, Stage::Reject, correspondences[i].target};
    }
    std::int32_t& best = nearest_[target];
    if (best < 0 ||
        correspondences[i].distance < correspondences[static_cast<std::size_t>(best)].distance) {
      best = static_cast<std::int32_t>(i);
    }
  }
  std::size_t kept = 0;
  for (std::size_t i = 0; i < correspondences.size(); ++i) {
    const Correspondence pair = correspondences[i];
    if (nearest_[static_cast<std::size_t>(pair.target)] == static_cast<std::int32_t>(i)) {
      correspondences[kept++] = pair;
    }
  }
  correspondences.resize(kept);
  return {};
}

}  // namespace grapnel
