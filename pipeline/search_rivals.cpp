// How surely the best pose is told from others, and what the judge asks about it alone.
#include <algorithm>
#include <array>

#include "pipeline/search.h"

namespace grapnel {
namespace {

// Rivals of at least this share of the best one's worth are compared with it pixel by pixel…
constexpr double kRival = 0.6;
// …and may take its place when they are as good as equal.
constexpr double kEqual = 0.9;
// Where the readings tell a mirror image apart this surely, thinned ones as well, nobody looks
// closer.
constexpr double kToldApart = 0.5;
// What is cut off from an object by a step in depth and still is of it lies this near, in
// diameters.
constexpr double kAttached = 0.05;

}  // namespace

void ObjectSearch::tell_apart(const ModelIndex& model, const MeasuredObject& object, double floor_m,
                              double least_worth, double least_margin) noexcept {
  dismissed_ = 1.0;
  alike_ = {};
  if (hopeless_ || candidates_.empty() || candidates_[0].worth < least_worth) return;
  test_rivals(model, object);
  if (!params_.siblings) return;
  for (const bool first : {true, false}) {
    const Pose asked = candidates_[0].refined.target_from_source;
    const Sightings sightings = sight_siblings(model, floor_m);
    alike_ = {};
    if (sightings.empty()) return;
    keep_best_picture(model, object);
    const bool one_is_better = compare_sightings(model, object, sightings);
    // Ambiguous as it is: whatever refinement finds, the margin won't grow.
    if (!first || (alike_.value < least_margin && !one_is_better)) return;
    refine_siblings(model, object, sightings, floor_m);
    test_rivals(model, object);
    // A sibling has taken its place: what looks like that one?
    const Pose& now = candidates_[0].refined.target_from_source;
    if (!distinct(model, now, asked, params_.distinct_ratio)) return;
  }
}

void ObjectSearch::test_rivals(const ModelIndex& model, const MeasuredObject& object) noexcept {
  for (std::size_t turn = 0; turn < candidates_.size(); ++turn) {
    if (!beaten_by_rival(model, object)) return;
  }
  // They beat each other in a circle: none is told from the others.
  for (Candidate& candidate : candidates_) candidate.told_apart = 0.0;
}

bool ObjectSearch::beaten_by_rival(const ModelIndex& model, const MeasuredObject& object) noexcept {
  const Candidate best = candidates_[0];
  bool kept = false;
  for (std::size_t i = 1; i < candidates_.size(); ++i) {
    Candidate& rival = candidates_[i];
    if (rival.worth < kRival * best.worth) continue;
    if (!distinct(model, rival.refined.target_from_source, best.refined.target_from_source,
                  params_.distinct_ratio)) {
      continue;
    }
    if (!kept) keep_best_picture(model, object);
    kept = true;
    const Contrast contrast = contrast_to(model, object, rival.refined.target_from_source);
    if (contrast.gain < 0.0 && rival.worth >= kEqual * best.worth) {
      candidates_[0] = rival;
      candidates_[0].told_apart = 0.0;
      rival = best;
      return true;
    }
    rival.told_apart = contrast.certainty();
  }
  return false;
}

void ObjectSearch::keep_best_picture(const ModelIndex& model,
                                     const MeasuredObject& object) noexcept {
  render_.render(model.fine, candidates_[0].refined.target_from_source, *object.view);
  rivals_.keep(render_);
}

Contrast ObjectSearch::contrast_to(const ModelIndex& model, const MeasuredObject& object,
                                   const Pose& rival) noexcept {
  render_.render(model.fine, rival, *object.view);
  return rivals_.against(render_, *object.view, object.shared_px);
}

ObjectSearch::Sightings ObjectSearch::sight_siblings(const ModelIndex& model,
                                                     double floor_m) noexcept {
  const Pose pose = candidates_[0].refined.target_from_source;
  Sightings sightings;
  if (model.siblings.empty()) return sightings;
  // Seen in the same way as they are.
  const double own = first_look(model, glanced_, pose, floor_m).worth;
  for (const Sibling& near : model.siblings) {
    const Pose sibling = pose * near.motion;
    if (!distinct(model, sibling, pose, params_.distinct_ratio)) continue;
    const double worth = first_look(model, glanced_, sibling, floor_m).worth;
    if (worth >= kAlternative * std::min(own, candidates_[0].worth)) {
      sightings.push_back({sibling, own > 0.0 ? worth / own : 1.0});
    }
  }
  return sightings;
}

bool ObjectSearch::compare_sightings(const ModelIndex& model, const MeasuredObject& object,
                                     const Sightings& sightings) noexcept {
  bool one_is_better = false;
  for (const Sighting& sibling : sightings.span()) {
    const Contrast contrast = contrast_to(model, object, sibling.pose);
    if (contrast.gain < 0.0 && !contrast.alike()) {
      one_is_better = true;
      continue;
    }
    const double margin = std::max(1.0 - sibling.worth_ratio, contrast.certainty());
    if (margin < alike_.value) alike_ = {margin, sibling.pose};
  }
  return one_is_better;
}

void ObjectSearch::refine_siblings(const ModelIndex& model, const MeasuredObject& object,
                                   const Sightings& sightings, double floor_m) noexcept {
  for (const Sighting& sibling : sightings.span()) {
    RefinedPose refined;
    if (!refine(model, object, sibling.pose, refined)) continue;
    // Nobody asks how well a pose fits that the readings refute where it differs.
    const Contrast contrast = contrast_to(model, object, refined.target_from_source);
    if (contrast.beyond_doubt()) {
      dismissed_ = std::min(dismissed_, contrast.certainty());
    } else {
      verify_pose(model, object, refined, floor_m);
    }
  }
  best_first();
}

Margin ObjectSearch::margin(const ModelIndex& model) const noexcept {
  if (candidates_.empty() || !(candidates_[0].worth > 0.0)) return {0.0, nullptr};
  Margin least{dismissed_, nullptr};
  if (alike_.value < least.value) least = {alike_.value, &alike_.pose};
  for (std::size_t i = 1; i < candidates_.size(); ++i) {
    const Pose& rival = candidates_[i].refined.target_from_source;
    if (!distinct(model, rival, candidates_[0].refined.target_from_source,
                  params_.distinct_ratio)) {
      continue;
    }
    const double ratio = std::max(0.0, candidates_[i].worth) / candidates_[0].worth;
    const double margin = std::max(1.0 - ratio, candidates_[i].told_apart);
    if (margin < least.value) least = {margin, &rival};
  }
  return least;
}

double ObjectSearch::mirror_margin(const ModelIndex& model, const MeasuredObject& object,
                                   double floor_m) noexcept {
  if (model.mirrored.empty() || candidates_.empty() || !(candidates_[0].worth > 0.0)) return 1.0;
  const Candidate& best = candidates_[0];
  const Pose& pose = best.refined.target_from_source;
  std::array<bool, ModelIndex::kSiblings> undecided;
  double least = 1.0;
  bool any = false;
  // Coarsely at first: most mirrored poses look like nothing that is there.
  render_.render(model.coarse, pose, *glanced_.view);
  rivals_.keep(render_);
  for (std::size_t i = 0; i < model.mirrored.size(); ++i) {
    render_.render(model.coarse, pose * model.mirrored[i].motion, *glanced_.view);
    const Contrast contrast = rivals_.against(render_, *glanced_.view, glanced_.shared_px);
    undecided[i] = contrast.certainty() < kToldApart;
    any = any || undecided[i];
    if (!undecided[i]) least = std::min(least, contrast.certainty());
  }
  if (!any) return least;
  render_.render(model.fine, pose, *object.view);
  rivals_.keep(render_);
  for (std::size_t i = 0; i < model.mirrored.size(); ++i) {
    if (!undecided[i]) continue;
    const Pose mirrored = pose * model.mirrored[i].motion;
    render_.render(model.fine, mirrored, *object.view);
    double apart = rivals_.against(render_, *object.view, object.shared_px).certainty();
    if (apart < kToldApart) {
      const double worth = look(model, object, mirrored, floor_m, false).worth;
      apart = std::max(apart, 1.0 - std::max(0.0, worth) / best.worth);
    }
    least = std::min(least, apart);
  }
  return least;
}

void ObjectSearch::show_best(const ModelIndex& model, const MeasuredObject& object) noexcept {
  const Pose& pose = candidates_[0].refined.target_from_source;
  render_.render(model.fine, pose, *object.view);
  render_.find_contour(model.fine, pose, *object.view);
}

GroundBeside ObjectSearch::ground_beside(const ModelIndex& model, const MeasuredObject& object,
                                         const Resting& resting, double tolerance_m) noexcept {
  return ground_.look(model.fine, candidates_[0].refined.target_from_source, render_, *object.view,
                      *object.edges, resting.lowest_m, resting.highest_m, tolerance_m);
}

PoseReadings ObjectSearch::information(const ModelIndex& model, const MeasuredObject& object,
                                       const ReadingSpread& spread) const noexcept {
  return pose_information(model.fine, candidates_[0].refined.target_from_source, render_,
                          *object.view, *object.edges, spread);
}

double ObjectSearch::left_over_m2(const ModelIndex& model, const MeasuredObject& object) noexcept {
  const Pose& pose = candidates_[0].refined.target_from_source;
  const LeftOver left_over(model.table, disc_radius_m(model.fine), pose, render_, *object.view,
                           static_cast<float>(kAttached * model.diameter_m));
  return verification_.left_over_m2(left_over, render_, *object.view);
}

}  // namespace grapnel
