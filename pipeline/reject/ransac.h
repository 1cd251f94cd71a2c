#pragma once

#include <cstddef>
#include <span>

#include "base/field.h"
#include "pipeline/coarse/kabsch.h"
#include "pipeline/reject/ends.h"
#include "pipeline/stage.h"

namespace grapnel {

struct RansacRejectorParams {
  std::size_t draws = 1000;
  double inlier_distance_m = 0.0;  ///< 0 = auto: 1.5 × the target's spacing
  /// Stops when a better motion has been drawn with this probability; 1 = never. PCL: 0.99.
  double confidence = 1.0;
  /// Refits of each new best motion to its own inliers, while their number grows. PCL: 0.
  std::size_t refits = 4;
};
[[nodiscard]] FieldTable ransac_rejector_fields() noexcept;

/// Keeps the pairs that agree with the rigid motion most pairs agree with (Fischler and Bolles
/// 1981; local optimisation by refits: Chum 2003). Triples whose edges differ by more than two
/// inlier distances are passed over: no motion has all three for inliers.
/// Errors: TooFewCorrespondences, NoConsensus, CapacityExceeded. O(draws × pairs) at the worst.
class RansacRejector final : public CorrespondenceRejector {
 public:
  explicit RansacRejector(const RansacRejectorParams& params) : params_(params) {}

  void reserve(Arena& arena, const Limits& limits) override;
  Status reject(const PairView& pair, Correspondences& correspondences, Rng& rng) noexcept override;

  /// Triples of the last run from which a motion was computed and rated.
  [[nodiscard]] std::size_t rated() const noexcept { return rated_; }

 private:
  struct Motion {
    Pose target_from_source = Pose::Identity();
    std::size_t inliers = 0;
  };
  /// False when the triple can't be of one motion.
  bool draw(float distance_m, Rng& rng, PointPairSums& sums) noexcept;
  [[nodiscard]] std::size_t rate(const Pose& pose, float square_m2,
                                 std::size_t to_beat) const noexcept;
  void optimise(Motion& best, float square_m2) const noexcept;
  /// Draws after which a better motion is missed with less than 1 - confidence.
  [[nodiscard]] std::size_t enough(std::size_t inliers) const noexcept;

  RansacRejectorParams params_;
  PairEnds ends_;
  std::size_t rated_ = 0;
};

}  // namespace grapnel
