#pragma once

#include <cstdint>
#include <span>

#include "base/field.h"
#include "pipeline/stage.h"

namespace grapnel {

struct OneToOneRejectorParams {};
[[nodiscard]] FieldTable one_to_one_rejector_fields() noexcept;

/// Keeps of all pairs with the same target the nearest one, the first of equals (PCL's
/// CorrespondenceRejectorOneToOne, without its sorting by target). Errors: CapacityExceeded.
class OneToOneRejector final : public CorrespondenceRejector {
 public:
  explicit OneToOneRejector(const OneToOneRejectorParams&) {}

  void reserve(Arena& arena, const Limits& limits) override;
  Status reject(const PairView& pair, Correspondences& correspondences, Rng& rng) noexcept override;

 private:
  std::span<std::int32_t> nearest_;  ///< of each target keypoint, the index of its pair
};

}  // namespace grapnel
