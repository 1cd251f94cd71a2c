#pragma once

#include <cstddef>
#include <span>

#include "base/field.h"
#include "pipeline/stage.h"

namespace grapnel {

struct RansacRejectorParams {
  std::size_t draws = 1000;
  double inlier_distance_m = 0.0;  ///< 0 = auto: 1.5 × the target's spacing
};
[[nodiscard]] FieldTable ransac_rejector_fields() noexcept;

/// Keeps the pairs that agree with the rigid motion most pairs agree with (Fischler and Bolles
/// 1981), after one least-squares fit to the inliers. Errors: TooFewCorrespondences, NoConsensus.
class RansacRejector final : public CorrespondenceRejector {
 public:
  explicit RansacRejector(const RansacRejectorParams& params) : params_(params) {}

  void reserve(Arena&, const Limits&) override {}
  Status reject(const PairView& pair, Correspondences& correspondences, Rng& rng) noexcept override;

 private:
  RansacRejectorParams params_;
};

}  // namespace grapnel
