#include "pipeline/preprocess/clusters.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "pipeline/preprocess/compact.h"

namespace grapnel {

FieldTable cluster_fields() noexcept {
  using P = ClusterParams;
  static constexpr std::array kFields = {
      number_field<&P::distance_m>("distance_m", "m", 0.0, 10.0,
                                   "longest step; 0 = distance_ratio spacings"),
      number_field<&P::distance_ratio>("distance_ratio", "", 0.1, 1000.0,
                                       "longest step in spacings of the surface"),
      number_field<&P::min_points>("min_points", "", 1, 10000000, "smaller clusters go"),
      number_field<&P::kept>("kept", "", 1, 100000, "clusters left, largest first"),
  };
  return kFields;
}

void Clusters::reserve(Arena& arena, const Limits& limits) {
  const std::size_t points =
      std::max({limits.max_input_points, limits.max_points, limits.max_model_points});
  search_.reserve(
      arena, points,
      static_cast<std::size_t>(limits.max_width) * static_cast<std::size_t>(limits.max_height));
  for (std::span<std::int32_t>* list : {&label_, &stack_, &size_of_}) {
    *list = arena.take<std::int32_t>(points);
  }
  keep_ = arena.take<std::uint8_t>(points);
}

void Clusters::label(const Surface& surface, float distance_m) noexcept {
  std::fill_n(label_.begin(), surface.size, -1);
  found_ = 0;
  for (std::size_t seed = 0; seed < surface.size; ++seed) {
    if (label_[seed] >= 0) continue;
    const auto own = static_cast<std::int32_t>(found_);
    label_[seed] = own;
    size_of_[found_] = 0;
    std::size_t top = 0;
    stack_[top++] = static_cast<std::int32_t>(seed);
    while (top > 0) {
      const auto point = static_cast<std::size_t>(stack_[--top]);
      ++size_of_[found_];
      for (const std::int32_t other : search_.within(point, distance_m).index) {
        const auto i = static_cast<std::size_t>(other);
        if (label_[i] >= 0) continue;
        label_[i] = own;
        stack_[top++] = other;
      }
    }
    ++found_;
  }
}

Result<std::size_t> Clusters::apply(Surface& surface) noexcept {
  if (const Status status = check_points(surface, keep_.size(), Stage::Segment); !status.ok()) {
    return status.error();
  }
  const double distance_m =
      params_.distance_m > 0.0 ? params_.distance_m : params_.distance_ratio * surface.spacing_m;
  if (!(distance_m > 0.0)) return Error{Code::BadParameter, Stage::Segment, 0};
  if (const Status status = search_.build(surface, distance_m); !status.ok()) {
    return Error{status.error().code, Stage::Segment, status.error().detail};
  }
  label(surface, static_cast<float>(distance_m));
  // The stack is free now: it takes the clusters in the order of their sizes.
  for (std::size_t c = 0; c < found_; ++c) stack_[c] = static_cast<std::int32_t>(c);
  std::sort(stack_.begin(), stack_.begin() + static_cast<std::ptrdiff_t>(found_),
            [&](std::int32_t a, std::int32_t b) {
              const std::int32_t size_a = size_of_[static_cast<std::size_t>(a)];
              const std::int32_t size_b = size_of_[static_cast<std::size_t>(b)];
              return size_a != size_b ? size_a > size_b : a < b;
            });
  const std::size_t kept = std::min(found_, static_cast<std::size_t>(params_.kept));
  if (size_of_[static_cast<std::size_t>(stack_[0])] < params_.min_points) {
    return Error{Code::TooFewPoints, Stage::Segment, size_of_[static_cast<std::size_t>(stack_[0])]};
  }
  std::fill_n(keep_.begin(), surface.size, std::uint8_t{0});
  for (std::size_t rank = 0; rank < found_; ++rank) {
    std::int32_t& size = size_of_[static_cast<std::size_t>(stack_[rank])];
    size = rank < kept && size >= params_.min_points ? 1 : 0;
  }
  for (std::size_t i = 0; i < surface.size; ++i) {
    keep_[i] = size_of_[static_cast<std::size_t>(label_[i])] != 0 ? 1 : 0;
  }
  return keep_points(surface, keep_);
}

}  // namespace grapnel
