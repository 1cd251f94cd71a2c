#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "base/field.h"
#include "pipeline/stage.h"

namespace grapnel {

struct TrimmedRejectorParams {
  double overlap_ratio = 0.5;  ///< share of the pairs kept
  std::size_t min_pairs = 0;   ///< and at least so many
};
[[nodiscard]] FieldTable trimmed_rejector_fields() noexcept;

/// Keeps the nearest share of the pairs, rounded down, the first of equals (PCL's
/// CorrespondenceRejectorTrimmed, without its sorting). Errors: CapacityExceeded.
class TrimmedRejector final : public CorrespondenceRejector {
 public:
  explicit TrimmedRejector(const TrimmedRejectorParams& params) : params_(params) {}

  void reserve(Arena& arena, const Limits& limits) override;
  Status reject(const PairView& pair, Correspondences& correspondences, Rng& rng) noexcept override;

 private:
  TrimmedRejectorParams params_;
  std::span<std::int32_t> order_;
};

}  // namespace grapnel
