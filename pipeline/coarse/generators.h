#pragma once

#include <cstdint>
#include <span>

#include "base/field.h"
#include "pipeline/refine/closest_in_cells.h"
#include "pipeline/stage.h"

namespace grapnel {

struct SvdParams {
  double inlier_m =
      0.0;  ///< pairs nearer than this support a pose; 0 = auto: inlier_ratio spacings
  double inlier_ratio = 2.5;
};
[[nodiscard]] FieldTable svd_fields() noexcept;

/// The one rigid motion with the least sum of squares over all correspondences (Kabsch 1976, Horn
/// 1987): right where rejection has left no wrong ones. Support: pairs within the distance.
class SvdGenerator final : public HypothesisGenerator {
 public:
  explicit SvdGenerator(const SvdParams& params) : params_(params) {}

  void reserve(Arena&, const Limits&) override {}
  Status generate(const PairView& pair, const Correspondences& correspondences, Rng& rng,
                  Hypotheses& hypotheses) noexcept override;

 private:
  SvdParams params_;
};

struct RansacGeneratorParams {
  int draws = 10000;
  double inlier_m = 0.0;  ///< 0 = auto: inlier_ratio spacings
  double inlier_ratio = 2.5;
  double min_edge_ratio = 0.9;
  double min_extent_share = 0.1;  ///< shortest edge of a triple, share of the keypoints' extent
  double distinct_ratio = 5.0;    ///< × inlier distance: poses farther apart are distinct
};
[[nodiscard]] FieldTable ransac_generator_fields() noexcept;

/// Poses from random triples of correspondences (Fischler and Bolles 1981), supported by the number
/// of pairs that a pose brings together; each new best is fitted to its pairs again (Chum, Matas
/// and Kittler 2003). Keeps distinct poses, best first.
class RansacGenerator final : public HypothesisGenerator {
 public:
  explicit RansacGenerator(const RansacGeneratorParams& params) : params_(params) {}

  void reserve(Arena&, const Limits&) override {}
  Status generate(const PairView& pair, const Correspondences& correspondences, Rng& rng,
                  Hypotheses& hypotheses) noexcept override;

 private:
  RansacGeneratorParams params_;
};

struct SampleConsensusParams {
  int draws = 1000;
  double max_distance_m = 0.0;  ///< at which a point's error is cut off; 0 = auto: ratio spacings
  double max_distance_ratio = 10.0;
  double min_extent_share = 0.1;  ///< shortest edge of a triple, share of the keypoints' extent
  int rated_points = 400;         ///< of the source, spread evenly; 0: all (PCL)
  double distinct_ratio = 1.0;    ///< × max_distance: poses farther apart are distinct
};
[[nodiscard]] FieldTable sample_consensus_fields() noexcept;

/// Sample consensus initial alignment (SAC-IA, Rusu 2009): random triples far enough apart, each
/// point with a random one of its correspondences; a pose is as good as the source's points lie
/// near the target's, errors being cut off. The correspondences should hold several candidates a
/// keypoint. Support: 1 - mean error over the cut-off.
class SampleConsensus final : public HypothesisGenerator {
 public:
  explicit SampleConsensus(const SampleConsensusParams& params) : params_(params) {}

  void reserve(Arena& arena, const Limits& limits) override;
  Status generate(const PairView& pair, const Correspondences& correspondences, Rng& rng,
                  Hypotheses& hypotheses) noexcept override;

 private:
  [[nodiscard]] double support(const Surface& source, const Surface& target, const Pose& pose,
                               float cut_m) const noexcept;

  SampleConsensusParams params_;
  ClosestInCells closest_;
};

}  // namespace grapnel
