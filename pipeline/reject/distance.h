#pragma once

#include "base/field.h"
#include "pipeline/stage.h"

namespace grapnel {

struct DistanceRejectorParams {
  double max_distance = 1.0;  ///< in the metric's own unit
};
[[nodiscard]] FieldTable distance_rejector_fields() noexcept;

/// Keeps pairs nearer than a distance (PCL's CorrespondenceRejectorDistance, which compares squares
/// with the square of the distance it is given).
class DistanceRejector final : public CorrespondenceRejector {
 public:
  explicit DistanceRejector(const DistanceRejectorParams& params) : params_(params) {}

  void reserve(Arena&, const Limits&) override {}
  Status reject(const PairView& pair, Correspondences& correspondences, Rng& rng) noexcept override;

 private:
  DistanceRejectorParams params_;
};

}  // namespace grapnel
