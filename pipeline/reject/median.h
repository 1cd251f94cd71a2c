#pragma once

#include <span>

#include "base/field.h"
#include "pipeline/stage.h"

namespace grapnel {

struct MedianRejectorParams {
  double factor = 1.0;
};
[[nodiscard]] FieldTable median_rejector_fields() noexcept;

/// Keeps pairs whose distance is at most factor × the median distance (upper one of an even count,
/// as in PCL's CorrespondenceRejectorMedianDistance).
class MedianRejector final : public CorrespondenceRejector {
 public:
  explicit MedianRejector(const MedianRejectorParams& params) : params_(params) {}

  void reserve(Arena& arena, const Limits& limits) override;
  Status reject(const PairView& pair, Correspondences& correspondences, Rng& rng) noexcept override;

 private:
  MedianRejectorParams params_;
  std::span<float> distances_;
};

}  // namespace grapnel
