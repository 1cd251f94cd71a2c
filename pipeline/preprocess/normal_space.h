#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "base/field.h"
#include "pipeline/stage.h"

namespace grapnel {

struct NormalSpaceParams {
  int points = 2000;  ///< left; a smaller cloud stays as it is
  int seed = 1;
};
[[nodiscard]] FieldTable normal_space_fields() noexcept;

/// Leaves points whose normals are spread as evenly as the cloud allows (Rusinkiewicz and Levoy
/// 2001, normal-space sampling): every direction gives the same number or all it has. A large flat
/// face then doesn't drown the few points that fix the other directions. Points without a normal
/// go.
class NormalSpaceSample final : public CloudFilter {
 public:
  explicit NormalSpaceSample(const NormalSpaceParams& params) noexcept : params_(params) {}

  /// Room for clouds of the limits' max_input_points.
  void reserve(Arena& arena, const Limits& limits) override;
  /// Errors: TooFewPoints (also: no point with a normal), CapacityExceeded, BadParameter (not
  /// finite).
  Result<std::size_t> apply(Surface& surface) noexcept override;

 private:
  NormalSpaceParams params_;
  std::span<std::uint8_t> keep_;
  std::span<std::uint8_t> bin_;
};

}  // namespace grapnel
