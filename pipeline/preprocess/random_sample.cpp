#include "pipeline/preprocess/random_sample.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/rng.h"
#include "pipeline/preprocess/compact.h"

namespace grapnel {

FieldTable random_sample_fields() noexcept {
  using P = RandomSampleParams;
  static constexpr std::array kFields = {
      number_field<&P::points>("points", "", 1, 10000000, "points left"),
      number_field<&P::seed>("seed", "", 0, 2000000000, "of the choice"),
  };
  return kFields;
}

void RandomSample::reserve(Arena& arena, const Limits& limits) {
  keep_ = arena.take<std::uint8_t>(
      std::max({limits.max_input_points, limits.max_points, limits.max_model_points}));
}

Result<std::size_t> RandomSample::apply(Surface& surface) noexcept {
  if (const Status status = check_points(surface, keep_.size(), Stage::Decimate); !status.ok()) {
    return status.error();
  }
  Rng rng(static_cast<std::uint64_t>(params_.seed));
  auto wanted =
      static_cast<std::uint32_t>(std::min(surface.size, static_cast<std::size_t>(params_.points)));
  for (std::size_t i = 0; i < surface.size; ++i) {
    const auto left = static_cast<std::uint32_t>(surface.size - i);
    keep_[i] = rng.below(left) < wanted ? 1 : 0;
    wanted -= keep_[i];
  }
  return keep_points(surface, keep_);
}

}  // namespace grapnel
