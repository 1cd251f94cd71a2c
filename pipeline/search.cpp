#include "pipeline/search.h"

#include <algorithm>
#include <array>
#include <span>

#include "base/insertion_sort.h"
#include "pipeline/coarse/hypothesis_list.h"
#include "pipeline/refine/normal_equations.h"

namespace grapnel {
namespace {

// Proposals this near are one, in diameters: less than coarse refinement bridges.
constexpr double kSame = 0.03;
// A pose rated this much below the best is not worth a look.
constexpr double kHopeless = 0.6;
// A quick rating of 2 is perfect; a part half hidden still gets more than this.
constexpr double kUnlikely = 0.8;
// A first look allows for poses that are not fine yet: times the match tolerance.
constexpr double kFirstLook = 3.0;
// It takes every second pixel of the view both ways, where at least so many are left across.
constexpr int kGlanceStride = 2;
constexpr double kFewestAcross_px = 48.0;
constexpr std::size_t kMaxContour = 4096;

PoseScore rating(const ModelIndex& model, const MeasuredObject& object, const SightImage& sight,
                 double tolerance_m) noexcept {
  PoseScore::Model source{&model.samples, &model.coarse_table, &model.coarse, &model.field};
  PoseScore::Scene scene;
  scene.sight = &sight;
  scene.samples = object.samples;
  return {source, scene, static_cast<float>(tolerance_m)};
}

/// One look-up instead of eight: near enough while poses are still coarse.
class QuickTable final : public ClosestSurface {
 public:
  explicit QuickTable(const ModelIndex& model) noexcept : model_(model) {}
  [[nodiscard]] std::int32_t closest(const Vec3f& p, float max_distance_m) const noexcept override {
    const std::int32_t found = model_.coarse_table.nearby(p);
    if (found < 0) return found;
    const Vec3f gap = model_.coarse.point(static_cast<std::size_t>(found)) - p;
    return gap.squaredNorm() <= max_distance_m * max_distance_m ? found : -1;
  }
  void closest_of_each(const float* x, const float* y, const float* z, std::size_t count,
                       float max_distance_m, std::int32_t* found) const noexcept override {
    model_.coarse_table.nearby_of_each(x, y, z, count, max_distance_m, found);
  }

 private:
  const ModelIndex& model_;
};

/// The refiners carry the measured points onto the model; the pipeline speaks of the inverse.
RefinedPose inverted(const RefinedPose& model_from_target) noexcept {
  RefinedPose result = model_from_target;
  result.target_from_source = model_from_target.target_from_source.inverse();
  result.information =
      information_of_inverse(model_from_target.information, model_from_target.target_from_source);
  return result;
}

}  // namespace

FieldTable search_fields() noexcept {
  using P = SearchParams;
  static constexpr std::array kFields = {
      number_field<&P::kept>("kept", "", 1, 1024, "poses carried to coarse refinement"),
      number_field<&P::finalists>("finalists", "", 1, 64, "poses carried to a first verification"),
      number_field<&P::winners>("winners", "", 1, 64, "poses carried to fine refinement"),
      number_field<&P::coarse_tolerance_ratio>("coarse_tolerance_ratio", "diameters", 0.001, 0.5,
                                               "what counts as met in a first rating"),
      bool_field<&P::siblings>("siblings", "try the poses that look nearly like the best one"),
      number_field<&P::distinct_ratio>("distinct_ratio", "diameters", 0.001, 1.0,
                                       "poses farther apart than this are distinct"),
  };
  return kFields;
}

void ObjectSearch::reserve(Arena& arena, const Limits& limits, std::size_t max_model_points) {
  const auto pixels =
      static_cast<std::size_t>(limits.max_width) * static_cast<std::size_t>(limits.max_height);
  verification_.reserve(arena, pixels, max_model_points);
  render_.reserve(arena, pixels, kMaxContour);
  ground_.reserve(arena, kMaxContour);
  rivals_.reserve(arena, pixels, static_cast<std::size_t>(limits.max_width));
  sight_.reserve(arena, pixels);
  const std::size_t glanced = pixels / (kGlanceStride * kGlanceStride);
  glance_depth_.reserve(arena, glanced);
  glance_edges_.reserve(arena, glanced);
  proposed_ = Hypotheses(arena.take<Hypothesis>(params_.kept));
  settled_ = Hypotheses(arena.take<Hypothesis>(params_.finalists));
  candidates_ = FixedList<Candidate>(
      arena.take<Candidate>(params_.finalists + params_.winners + ModelIndex::kSiblings));
}

void ObjectSearch::propose(ModelIndex& model, const MeasuredObject& object,
                           const Correspondences& correspondences, const Pose* initial,
                           Rng& rng) noexcept {
  proposed_.clear();
  sight_.build(*object.view);
  const PoseScore score =
      rating(model, object, sight_, params_.coarse_tolerance_ratio * model.diameter_m);
  if (initial != nullptr) keep_best(proposed_, {*initial, score(*initial, SIZE_MAX)});
  model.templates.propose(object.middle, score, proposed_);
  const PairView pair{
      &model.coarse, object.surface, model.keypoints.span(), object.keypoints->span(),
      &score,        object.ground};
  // Without consensus the views' poses stand alone.
  (void)generator_.generate(pair, correspondences, rng, proposed_);
}

bool ObjectSearch::distinct(const ModelIndex& model, const Pose& a, const Pose& b,
                            double ratio) const noexcept {
  const Pose nearest = nearest_equivalent(a, b, model.symmetry);
  return displacement_m(nearest, b, model.centre, 0.5 * model.diameter_m) >
         ratio * model.diameter_m;
}

void ObjectSearch::settle(const ModelIndex& model, const MeasuredObject& object) noexcept {
  settled_.clear();
  const QuickTable table(model);
  const PoseScore score =
      rating(model, object, sight_, 0.5 * params_.coarse_tolerance_ratio * model.diameter_m);
  std::size_t starts = 0;
  for (std::size_t i = 0; i < proposed_.size(); ++i) {
    const Hypothesis hypothesis = proposed_[i];
    // Of poses that end in one place the best suffices.
    const auto same = [&](const Hypothesis& better) {
      return displacement_m(better.target_from_source, hypothesis.target_from_source, model.centre,
                            0.5 * model.diameter_m) < kSame * model.diameter_m;
    };
    const std::span<const Hypothesis> before = proposed_.span().first(starts);
    if (std::any_of(before.begin(), before.end(), same)) continue;
    proposed_[starts++] = hypothesis;
    const Result<RefinedPose> refined = coarse_refiner_.refine(
        *object.surface, model.coarse, table, hypothesis.target_from_source.inverse());
    if (!refined.ok()) continue;
    Hypothesis settled;
    settled.target_from_source = refined.value().target_from_source.inverse();
    settled.support = score(settled.target_from_source, SIZE_MAX);
    bool merged = false;
    for (Hypothesis& other : settled_) {
      if (distinct(model, settled.target_from_source, other.target_from_source,
                   params_.distinct_ratio)) {
        continue;
      }
      merged = true;
      if (settled.support > other.support) other = settled;
      break;
    }
    if (!merged) keep_best(settled_, settled);
  }
  insertion_sort(settled_.begin(), settled_.end(),
                 [](const Hypothesis& a, const Hypothesis& b) { return a.support > b.support; });
}

void ObjectSearch::keep_candidate(const ModelIndex& model, const Candidate& candidate) noexcept {
  for (Candidate& other : candidates_) {
    if (distinct(model, candidate.refined.target_from_source, other.refined.target_from_source,
                 params_.distinct_ratio)) {
      continue;
    }
    if (candidate.worth > other.worth) other = candidate;
    return;
  }
  candidates_.push_back(candidate);
}

bool ObjectSearch::refine(const ModelIndex& model, const MeasuredObject& object, const Pose& start,
                          RefinedPose& refined) noexcept {
  const Result<RefinedPose> fine =
      fine_refiner_.refine(*object.surface, model.fixed(), model.table, start.inverse());
  if (!fine.ok()) return false;
  refined = inverted(fine.value());
  const Result<RefinedPose> joint =
      contour_.refine(*object.surface, model.fixed(), model.table, *object.view, *object.edges,
                      refined.target_from_source, model.diameter_m, render_);
  if (joint.ok() && joint.value().iterations > 0) {
    const std::uint32_t before = refined.iterations;
    refined = joint.value();
    refined.iterations += before;
  }
  return true;
}

Candidate ObjectSearch::look(const ModelIndex& model, const MeasuredObject& object,
                             const Pose& pose, double floor_m, bool whole) noexcept {
  Candidate candidate;
  candidate.refined.target_from_source = pose;
  render_.render(model.fine, pose, *object.view);
  render_.find_contour(model.fine, pose, *object.view);
  candidate.evidence = verification_.verify(model.fine, model.flat, pose, render_, *object.view,
                                            *object.edges, floor_m, whole);
  candidate.worth = worth(candidate.evidence);
  return candidate;
}

Candidate ObjectSearch::first_look(const ModelIndex& model, const MeasuredObject& glanced,
                                   const Pose& pose, double floor_m) noexcept {
  return look(model, glanced, pose, kFirstLook * floor_m, false);
}

void ObjectSearch::verify_pose(const ModelIndex& model, const MeasuredObject& object,
                               const RefinedPose& refined, double floor_m) noexcept {
  Candidate candidate = look(model, object, refined.target_from_source, floor_m, true);
  candidate.refined = refined;
  keep_candidate(model, candidate);
}

void ObjectSearch::best_first() noexcept {
  insertion_sort(candidates_.begin(), candidates_.end(),
                 [](const Candidate& a, const Candidate& b) { return a.worth > b.worth; });
}

MeasuredObject ObjectSearch::glance(const ModelIndex& model,
                                    const MeasuredObject& object) noexcept {
  const DepthView& view = *object.view;
  const double z_m = std::max(0.1, object.middle.z());
  if (model.diameter_m * view.intrinsics.fx / z_m < kGlanceStride * kFewestAcross_px) return object;
  glance_view_ = view;
  glance_depth_.thin(glance_view_, kGlanceStride);
  glance_edges_.build(glance_view_);
  MeasuredObject glanced = object;
  glanced.view = &glance_view_;
  glanced.edges = &glance_edges_;
  glanced.shared_px = std::max(1.0, object.shared_px / (kGlanceStride * kGlanceStride));
  return glanced;
}

void ObjectSearch::refine_best(const ModelIndex& model, const MeasuredObject& object,
                               double floor_m) noexcept {
  // A first look, coarse and at a wide tolerance, orders the finalists.
  candidates_.clear();
  glanced_ = glance(model, object);
  for (const Hypothesis& hypothesis : settled_) {
    const bool first = &hypothesis == settled_.begin();
    if (!first &&
        (hypothesis.support < settled_[0].support - kHopeless || hypothesis.support < kUnlikely)) {
      break;
    }
    keep_candidate(model, first_look(model, glanced_, hypothesis.target_from_source, floor_m));
  }
  best_first();
  // No pose meets even half of what it should: one is refined, for the report.
  hopeless_ = settled_.empty() || settled_[0].support < kUnlikely;
  const std::size_t winners = hopeless_ ? 1 : params_.winners;
  settled_.clear();
  for (std::size_t i = 0; i < std::min(winners, candidates_.size()); ++i) {
    keep_best(settled_, {candidates_[i].refined.target_from_source, candidates_[i].worth});
  }

  candidates_.clear();
  double best = 0.0;
  for (const Hypothesis& hypothesis : settled_) {
    if (hypothesis.support < kAlternative * best) break;
    RefinedPose refined;
    if (!refine(model, object, hypothesis.target_from_source, refined)) continue;
    verify_pose(model, object, refined, floor_m);
    best_first();
    best = candidates_[0].worth;
  }
}

}  // namespace grapnel
