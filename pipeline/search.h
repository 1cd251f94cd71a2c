#pragma once

#include <cstddef>
#include <cstdint>

#include "base/arena.h"
#include "base/field.h"
#include "pipeline/coarse/pose_score.h"
#include "pipeline/features.h"
#include "pipeline/judge/depth_view.h"
#include "pipeline/judge/ground_beside.h"
#include "pipeline/judge/model_render.h"
#include "pipeline/judge/pose_information.h"
#include "pipeline/judge/resting.h"
#include "pipeline/judge/rival_test.h"
#include "pipeline/judge/verification.h"
#include "pipeline/limits.h"
#include "pipeline/margin.h"
#include "pipeline/model_index.h"
#include "pipeline/refine/contour_fit.h"
#include "pipeline/stage.h"

namespace grapnel {

struct SearchParams {
  std::size_t kept = 60;                 ///< poses carried from proposal to coarse refinement
  std::size_t finalists = 10;            ///< and from there to a first verification
  std::size_t winners = 3;               ///< and from there to fine refinement
  double coarse_tolerance_ratio = 0.05;  ///< × model diameter: what counts as met at first
  bool siblings = true;          ///< also try the poses that nearly map the model onto itself
  double distinct_ratio = 0.05;  ///< × model diameter: poses farther apart are distinct
};
[[nodiscard]] FieldTable search_fields() noexcept;

/// One measured object with everything the search looks at.
struct MeasuredObject {
  const Surface* surface = nullptr;
  const SampleSet* samples = nullptr;
  KeypointSet* keypoints = nullptr;
  FeatureMatrix* features = nullptr;
  const DepthView* view = nullptr;
  const EdgeMap* edges = nullptr;
  const Ground* ground = nullptr;  ///< what it stands on; null = nobody knows
  Vec3d middle = Vec3d::Zero();    ///< mean of its points
  double shared_px = 1.0;          ///< pixels of the view that share one error
};

/// A pose after refinement, and what the measurement says about it.
struct Candidate {
  RefinedPose refined;
  Evidence evidence;
  double worth = 0.0;
  double told_apart = 0.0;  ///< how surely the best candidate is told from it, 0…1
};

/// Finds the best pose of a model on a measured object: proposes, refines coarsely, refines finely,
/// verifies, and looks for the best distinct alternative.
class ObjectSearch {
 public:
  /// The stages must outlive the search. `generator` supports by the view's score.
  ObjectSearch(const SearchParams& search, HypothesisGenerator& generator,
               PoseRefiner& coarse_refiner, PoseRefiner& fine_refiner,
               const ContourFitParams& contour)
      : params_(search),
        generator_(generator),
        coarse_refiner_(coarse_refiner),
        fine_refiner_(fine_refiner),
        contour_(contour) {}

  void reserve(Arena& arena, const Limits& limits, std::size_t max_model_points);

  /// Proposes poses from features and from views; `initial`, where given, stands beside them.
  void propose(ModelIndex& model, const MeasuredObject& object,
               const Correspondences& correspondences, const Pose* initial, Rng& rng) noexcept;
  /// Refines what was proposed and verifies the best; candidates() are then best first.
  void settle(const ModelIndex& model, const MeasuredObject& object) noexcept;
  /// Refines the best of those finely and verifies them; candidates() are then these, best first.
  void refine_best(const ModelIndex& model, const MeasuredObject& object, double floor_m) noexcept;
  /// Asks how surely the best is told from others, its siblings among them. Below `least_worth` no
  /// pose is accepted, then nobody asks; nor any further than to a margin below `least_margin`.
  void tell_apart(const ModelIndex& model, const MeasuredObject& object, double floor_m,
                  double least_worth, double least_margin) noexcept;

  [[nodiscard]] std::size_t hypothesis_count() const noexcept { return proposed_.size(); }
  [[nodiscard]] const FixedList<Candidate>& candidates() const noexcept { return candidates_; }
  /// From the best candidate to the nearest distinct one, 0…1: 1 - S2/S1, or how surely the
  /// surface where the two differ tells them apart, whichever is more; 1 when there is no other.
  [[nodiscard]] Margin margin(const ModelIndex& model) const noexcept;
  /// From the best candidate to the model's mirror image where that comes nearest to it, 0…1, as
  /// margin(); 1 where the model has none. O(mirrored siblings × pixels of the model).
  [[nodiscard]] double mirror_margin(const ModelIndex& model, const MeasuredObject& object,
                                     double floor_m) noexcept;
  /// Renders the best candidate, outline included, for what looks at it alone. Precondition of all
  /// below: there is one, and this was called.
  void show_best(const ModelIndex& model, const MeasuredObject& object) noexcept;
  /// Largest piece that the best candidate leaves over, squared metres; see LeftOver.
  [[nodiscard]] double left_over_m2(const ModelIndex& model, const MeasuredObject& object) noexcept;
  /// What lies beside the best candidate; see GroundSearch.
  [[nodiscard]] GroundBeside ground_beside(const ModelIndex& model, const MeasuredObject& object,
                                           const Resting& resting, double tolerance_m) noexcept;
  /// What the measurement says about the best candidate's pose; see pose_information().
  [[nodiscard]] PoseReadings information(const ModelIndex& model, const MeasuredObject& object,
                                         const ReadingSpread& spread) const noexcept;

 private:
  /// The object as a coarser view shows it, if it is large enough for that.
  [[nodiscard]] MeasuredObject glance(const ModelIndex& model,
                                      const MeasuredObject& object) noexcept;
  /// Fine refinement; false when it lost its partners.
  bool refine(const ModelIndex& model, const MeasuredObject& object, const Pose& start,
              RefinedPose& refined) noexcept;
  /// What the measurement says of a pose; without `whole` for its worth alone.
  [[nodiscard]] Candidate look(const ModelIndex& model, const MeasuredObject& object,
                               const Pose& pose, double floor_m, bool whole) noexcept;
  /// A first look at a pose that is not fine yet: at a wide tolerance, for its worth alone.
  [[nodiscard]] Candidate first_look(const ModelIndex& model, const MeasuredObject& glanced,
                                     const Pose& pose, double floor_m) noexcept;
  void verify_pose(const ModelIndex& model, const MeasuredObject& object,
                   const RefinedPose& refined, double floor_m) noexcept;
  /// Renders the best candidate into rivals_, for contrast_to().
  void keep_best_picture(const ModelIndex& model, const MeasuredObject& object) noexcept;
  /// What the measurement says of the best candidate against another pose.
  [[nodiscard]] Contrast contrast_to(const ModelIndex& model, const MeasuredObject& object,
                                     const Pose& rival) noexcept;

  /// A sibling of the best pose as it stands, and its worth over the best one's at first sight.
  struct Sighting {
    Pose pose = Pose::Identity();
    double worth_ratio = 0.0;
  };
  using Sightings = InlineList<Sighting, ModelIndex::kSiblings>;
  /// The best pose's siblings that are not out of the question.
  [[nodiscard]] Sightings sight_siblings(const ModelIndex& model, double floor_m) noexcept;
  /// Fills alike_: the margin to the sibling that looks most like the best pose, before refinement
  /// may lead it away from where it does. True where the readings speak for one of them.
  [[nodiscard]] bool compare_sightings(const ModelIndex& model, const MeasuredObject& object,
                                       const Sightings& sightings) noexcept;
  /// Makes candidates of the siblings, but those that the readings refute: a nearly symmetric part
  /// must be called ambiguous, not wrong.
  void refine_siblings(const ModelIndex& model, const MeasuredObject& object,
                       const Sightings& sightings, double floor_m) noexcept;
  /// Compares the best with its near rivals where they differ; a rival that fits better there
  /// takes its place.
  void test_rivals(const ModelIndex& model, const MeasuredObject& object) noexcept;
  bool beaten_by_rival(const ModelIndex& model, const MeasuredObject& object) noexcept;
  void best_first() noexcept;
  [[nodiscard]] bool distinct(const ModelIndex& model, const Pose& a, const Pose& b,
                              double ratio) const noexcept;
  void keep_candidate(const ModelIndex& model, const Candidate& candidate) noexcept;

  /// Poses below this share of the best one's worth can't become its rivals by refinement.
  static constexpr double kAlternative = 0.4;

  SearchParams params_;
  HypothesisGenerator& generator_;
  PoseRefiner& coarse_refiner_;
  PoseRefiner& fine_refiner_;
  ContourFit contour_;
  Verification verification_;
  ModelRender render_;
  RivalTest rivals_;
  GroundSearch ground_;
  SightImage sight_;  ///< of what propose() looked at
  ThinnedDepth glance_depth_;
  EdgeMap glance_edges_;
  DepthView glance_view_;
  MeasuredObject glanced_;  ///< the object, as first looks see it
  bool hopeless_ = false;   ///< no pose meets even half of what it should
  struct Alike {
    double value = 1.0;
    Pose pose = Pose::Identity();
  };
  Alike alike_;             ///< the sibling that looks most like the best pose
  double dismissed_ = 1.0;  ///< how surely the best is told from siblings that fell out
  Hypotheses proposed_;
  Hypotheses settled_;
  FixedList<Candidate> candidates_;
};

}  // namespace grapnel
