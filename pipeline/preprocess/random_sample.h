#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "base/field.h"
#include "pipeline/stage.h"

namespace grapnel {

struct RandomSampleParams {
  int points = 5000;  ///< left; a smaller cloud stays as it is
  int seed = 1;
};
[[nodiscard]] FieldTable random_sample_fields() noexcept;

/// Leaves a given number of points, every subset being equally likely (Knuth 1998, algorithm
/// 3.4.2S), in their order.
class RandomSample final : public CloudFilter {
 public:
  explicit RandomSample(const RandomSampleParams& params) noexcept : params_(params) {}

  /// Room for clouds of the limits' max_input_points.
  void reserve(Arena& arena, const Limits& limits) override;
  /// Errors: TooFewPoints, CapacityExceeded, BadParameter (not finite).
  Result<std::size_t> apply(Surface& surface) noexcept override;

 private:
  RandomSampleParams params_;
  std::span<std::uint8_t> keep_;
};

}  // namespace grapnel
