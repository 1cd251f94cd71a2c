#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "base/arena.h"
#include "base/error.h"
#include "base/rng.h"
#include "pipeline/features.h"
#include "pipeline/ground.h"
#include "pipeline/limits.h"
#include "pipeline/model.h"
#include "pipeline/surface.h"

namespace grapnel {

/// A step of the pipeline. Made when a preset is loaded (may allocate and throw there); after that
/// all of its memory comes from reserve(), which runs twice: once to measure, once to carve.
class PipelineStage {
 public:
  virtual ~PipelineStage() = default;
  virtual void reserve(Arena& arena, const Limits& limits) = 0;
};

/// Two engines behind one definition: plain double loops, or the production one.
enum class Engine : std::uint8_t { Fast, Reference };

/// Removes or changes points of a cloud in place. Keeps the grid of an organised surface
/// consistent.
class CloudFilter : public PipelineStage {
 public:
  /// Points removed, or an Error (TooFewPoints, CapacityExceeded).
  virtual Result<std::size_t> apply(Surface& surface) noexcept = 0;
};

/// Fills the normals of a surface, toward the viewpoint where it has one.
class NormalEstimator : public PipelineStage {
 public:
  virtual Status estimate(Surface& surface) noexcept = 0;
};

/// Finds interest points. Errors: TooFewPoints. More than fit: the strongest are kept, the set is
/// marked.
class KeypointDetector : public PipelineStage {
 public:
  virtual Status detect(const Surface& surface, KeypointSet& keypoints) noexcept = 0;
};

/// Describes keypoints by their surroundings on the surface. A keypoint that can't be described
/// (too few neighbours, no normals) gets a row of zeros, which never matches.
class DescriptorEstimator : public PipelineStage {
 public:
  [[nodiscard]] virtual std::size_t dimension() const noexcept = 0;
  virtual Status describe(const Surface& surface, std::span<const Keypoint> keypoints,
                          FeatureMatrix& features) noexcept = 0;
};

/// Pairs rows of two feature matrices.
class FeatureMatcher : public PipelineStage {
 public:
  virtual Status match(const FeatureMatrix& source, const FeatureMatrix& target,
                       Correspondences& correspondences) noexcept = 0;
};

class PoseScore;

/// What a rejector or a coarse step may look at beside the pairs.
struct PairView {
  const Surface* source = nullptr;
  const Surface* target = nullptr;
  std::span<const Keypoint> source_keypoints;
  std::span<const Keypoint> target_keypoints;
  /// Worth of a pose by both surfaces; null where a step is used alone.
  const PoseScore* score = nullptr;
  /// What the target stands on, in its frame; null = nobody knows.
  const Ground* ground = nullptr;
};

/// Shortens a list of correspondences in place, keeping its order.
class CorrespondenceRejector : public PipelineStage {
 public:
  virtual Status reject(const PairView& pair, Correspondences& correspondences,
                        Rng& rng) noexcept = 0;
};

/// Proposes poses. Errors: TooFewCorrespondences, NoConsensus, BadParameter (it needs a score and
/// the view has none).
class HypothesisGenerator : public PipelineStage {
 public:
  /// True where a hypothesis's support is PairView::score's worth of it, so that the hypotheses of
  /// several generators compare. Others are rated anew by whoever mixes them.
  [[nodiscard]] virtual bool supports_by_score() const noexcept { return false; }
  /// False where the surfaces alone are looked at.
  [[nodiscard]] virtual bool needs_correspondences() const noexcept { return true; }
  /// Adds to `hypotheses`, best first.
  virtual Status generate(const PairView& pair, const Correspondences& correspondences, Rng& rng,
                          Hypotheses& hypotheses) noexcept = 0;
};

/// Where a refiner finds the partner of a point: a model's closest-point table, a view's grid, or
/// cells.
class ClosestSurface {
 public:
  virtual ~ClosestSurface() = default;
  /// Index of the surface point nearest to `p` (frame of that surface) within `max_distance_m`,
  /// else -1.
  [[nodiscard]] virtual std::int32_t closest(const Vec3f& p,
                                             float max_distance_m) const noexcept = 0;
  /// The same for many points, -1 = none. A point named may lie farther than `max_distance_m`.
  /// The arrays hold the next multiple of eight elements.
  virtual void closest_of_each(const float* x, const float* y, const float* z, std::size_t count,
                               float max_distance_m, std::int32_t* found) const noexcept {
    for (std::size_t i = 0; i < count; ++i) {
      found[i] = closest(Vec3f(x[i], y[i], z[i]), max_distance_m);
    }
  }
  /// A near point instead of the nearest, where that is to be had sooner: for steps whose partners
  /// are still to change.
  virtual void nearby_of_each(const float* x, const float* y, const float* z, std::size_t count,
                              float max_distance_m, std::int32_t* found) const noexcept {
    closest_of_each(x, y, z, count, max_distance_m, found);
  }
};

/// Moves a start pose to the nearest optimum. Errors: RefinementDiverged.
class PoseRefiner : public PipelineStage {
 public:
  /// `moving` is carried onto `fixed` (whose partners come from `closest`); `fixed_from_moving`
  /// starts it.
  virtual Result<RefinedPose> refine(const Surface& moving, const Surface& fixed,
                                     const ClosestSurface& closest,
                                     const Pose& fixed_from_moving) noexcept = 0;
};

}  // namespace grapnel
