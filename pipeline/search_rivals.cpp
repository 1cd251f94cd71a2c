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
                              double least_worth) noexcept {
  if (hopeless_ || candidates_.empty() || candidates_[0].worth < least_worth) return;
  if (params_.siblings) try_siblings(model, object, floor_m);
  test_rivals(model, object);
}

void ObjectSearch::test_rivals(const ModelIndex& model, const MeasuredObject& object) noexcept {
  for (std::size_t turn = 0; turn < candidates_.size(); ++turn) {
    if (!beaten_by_rival(model, object)) return;
  }
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
    if (!kept) {
      render_.render(model.fine, best.refined.target_from_source, *object.view);
      rivals_.keep(render_);
      kept = true;
    }
    render_.render(model.fine, rival.refined.target_from_source, *object.view);
    const Contrast contrast = rivals_.against(render_, *object.view, object.shared_px);
    if (contrast.gain < 0.0 && rival.worth >= kEqual * best.worth) {
      candidates_[0] = rival;
      rival = best;
      return true;
    }
    rival.told_apart = contrast.certainty();
  }
  return false;
}

void ObjectSearch::try_siblings(const ModelIndex& model, const MeasuredObject& object,
                                double floor_m) noexcept {
  const Pose best = candidates_[0].refined.target_from_source;
  const double best_worth = candidates_[0].worth;
  for (const Sibling& near : model.siblings) {
    const Pose sibling = best * near.motion;
    if (!distinct(model, sibling, best, params_.distinct_ratio)) continue;
    const Candidate seen = first_look(model, glanced_, sibling, floor_m);
    if (seen.worth < kAlternative * best_worth) continue;
    RefinedPose refined;
    if (!refine(model, object, sibling, refined)) continue;
    verify_pose(model, object, refined, floor_m);
  }
  best_first();
}

double ObjectSearch::margin(const ModelIndex& model) const noexcept {
  if (candidates_.empty() || !(candidates_[0].worth > 0.0)) return 0.0;
  double least = 1.0;
  for (std::size_t i = 1; i < candidates_.size(); ++i) {
    if (!distinct(model, candidates_[i].refined.target_from_source,
                  candidates_[0].refined.target_from_source, params_.distinct_ratio)) {
      continue;
    }
    const double ratio = std::max(0.0, candidates_[i].worth) / candidates_[0].worth;
    least = std::min(least, std::max(1.0 - ratio, candidates_[i].told_apart));
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
