#include "pipeline/reject/median.h"

#include <algorithm>
#include <array>

#include "pipeline/reject/ends.h"

namespace grapnel {

FieldTable median_rejector_fields() noexcept {
  static constexpr std::array kFields = {
      number_field<&MedianRejectorParams::factor>(
          "factor", "", 0.01, 1000.0, "pairs beyond factor × median distance are dropped"),
  };
  return kFields;
}

void MedianRejector::reserve(Arena& arena, const Limits& limits) {
  distances_ = arena.take<float>(limits.max_correspondences);
}

Status MedianRejector::reject(const PairView&, Correspondences& correspondences, Rng&) noexcept {
  const std::size_t count = correspondences.size();
  if (count == 0) return {};
  if (count > distances_.size()) {
    return Error{Code::CapacityExceeded, Stage::Reject, static_cast<std::int32_t>(count)};
  }
  for (std::size_t i = 0; i < count; ++i) distances_[i] = sort_key(correspondences[i]);
  const auto middle = distances_.begin() + static_cast<std::ptrdiff_t>(count / 2);
  std::nth_element(distances_.begin(), middle,
                   distances_.begin() + static_cast<std::ptrdiff_t>(count));
  const auto limit = static_cast<float>(params_.factor * static_cast<double>(*middle));
  std::size_t kept = 0;
  for (std::size_t i = 0; i < count; ++i) {
    if (correspondences[i].distance <= limit) correspondences[kept++] = correspondences[i];
  }
  correspondences.resize(kept);
  return {};
}

}  // namespace grapnel
