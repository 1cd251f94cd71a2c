#include "pipeline/reject/trimmed.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "pipeline/reject/ends.h"

namespace grapnel {

FieldTable trimmed_rejector_fields() noexcept {
  using P = TrimmedRejectorParams;
  static constexpr std::array kFields = {
      number_field<&P::overlap_ratio>("overlap_ratio", "", 0.0, 1.0,
                                      "share of the pairs kept, the nearest"),
      number_field<&P::min_pairs>("min_pairs", "", 0, 1000000, "and at least so many"),
  };
  return kFields;
}

void TrimmedRejector::reserve(Arena& arena, const Limits& limits) {
  order_ = arena.take<std::int32_t>(limits.max_correspondences);
}

Status TrimmedRejector::reject(const PairView&, Correspondences& correspondences, Rng&) noexcept {
  const std::size_t count = correspondences.size();
  if (count > order_.size()) {
    return Error{Code::CapacityExceeded, Stage::Reject, static_cast<std::int32_t>(count)};
  }
  const auto share = static_cast<std::size_t>(
      std::floor(static_cast<float>(params_.overlap_ratio) * static_cast<float>(count)));
  const std::size_t kept = std::max(share, params_.min_pairs);
  if (kept >= count) return {};
  const std::span<std::int32_t> order = order_.first(count);
  std::iota(order.begin(), order.end(), 0);
  const auto nearer = [&](std::int32_t a, std::int32_t b) {
    const float of_a = sort_key(correspondences[static_cast<std::size_t>(a)]);
    const float of_b = sort_key(correspondences[static_cast<std::size_t>(b)]);
    return of_a < of_b || (of_a == of_b && a < b);
  };
  const auto last = order.begin() + static_cast<std::ptrdiff_t>(kept);
  std::nth_element(order.begin(), last, order.end(), nearer);
  std::sort(order.begin(), last);
  for (std::size_t i = 0; i < kept; ++i) {
    correspondences[i] = correspondences[static_cast<std::size_t>(order[i])];
  }
  correspondences.resize(kept);
  return {};
}

}  // namespace grapnel
