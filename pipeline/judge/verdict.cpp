#include "pipeline/judge/verdict.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "pipeline/judge/checks.h"

namespace grapnel {
namespace {

// Of an outline known to a smaller share than this nothing follows.
constexpr double kTestable = 0.2;
// With the belt around this much of its outline a part has the belt below it: it can't reach into
// it by more than its pose and the plane are uncertain, in diameters.
constexpr double kBeltAround = 0.5;
constexpr double kMostSunk = 0.03;
// Where this much of the outline shows what the part stands on or hangs from, it may end above the
// ground.
constexpr double kBorne = 0.1;
// Ground that lies higher than the part's middle is not what it stands on but what is beside it.
constexpr double kMiddle = 0.5;
// A part's height is known to this share of it, feet and rounded edges included: less than half way
// to a part that counts as one of another size.
constexpr double kHeightKnown = 0.04;
// A model without an underside may have been cut off this far above it, in diameters.
constexpr double kCutOff = 0.1;

}  // namespace

FieldTable verdict_fields() noexcept {
  using P = VerdictParams;
  static constexpr std::array kFields = {
      number_field<&P::min_fitness>("min_fitness", "", 0.0, 1.0,
                                    "matched share of the visible model"),
      number_field<&P::min_area_m2>("min_area_m2", "m2", 0.0, 100.0,
                                    "matched surface; 0 = a hundredth of the squared diameter"),
      number_field<&P::max_rmse_ratio>("max_rmse_ratio", "", 0.05, 1.0,
                                       "deviation of matched pixels, share of the tolerance"),
      number_field<&P::max_seen_through>("max_seen_through", "", 0.0, 1.0,
                                         "share of the visible model that the camera sees through"),
      number_field<&P::max_hole_m2>(
          "max_hole_m2", "m2", 0.0, 100.0,
          "largest piece seen through; 0 = a five-hundredth of the squared diameter"),
      number_field<&P::max_unknown>("max_unknown", "", 0.0, 1.0,
                                    "share of the visible model without reading"),
      number_field<&P::max_outside>("max_outside", "", 0.0, 1.0,
                                    "share of the visible model beyond the image's ends"),
      number_field<&P::max_unexplained>("max_unexplained", "", 0.0, 10.0,
                                        "object's surface the model leaves over"),
      number_field<&P::min_explained>("min_explained", "", 0.0, 1.0,
                                      "share of the whole measured object that is explained"),
      number_field<&P::max_left_over>("max_left_over", "squared diameters", 0.0, 10.0,
                                      "largest piece of the object beside the model; 0 = off"),
      number_field<&P::min_edge>("min_edge", "", 0.0, 1.0,
                                 "share of the known outline that meets a depth edge"),
      number_field<&P::min_edge_known>("min_edge_known", "", 0.0, 1.0,
                                       "share of the outline about which readings say anything"),
      number_field<&P::min_second_face>(
          "min_second_face", "", 0.0, 0.67,
          "matched surface off the main direction; with less a match counts as flat"),
      number_field<&P::min_flat_proof>(
          "min_flat_proof", "", 0.0, 1.0,
          "of a flat match: fitness times the share of its outline that depth edges prove"),
      number_field<&P::min_margin>("min_margin", "", 0.0, 1.0,
                                   "distance to the second-best distinct pose"),
      number_field<&P::min_mirror_margin>(
          "min_mirror_margin", "", 0.0, 1.0,
          "distance to the mirror image, of a part that is not its own; 0 = off"),
      number_field<&P::max_sigma_m>("max_sigma_m", "m", 0.0, 1.0,
                                    "predicted deviation, weakest required direction"),
      number_field<&P::max_sigma_rad>("max_sigma_rad", "rad", 0.0, 1.0,
                                      "predicted deviation, weakest required axis"),
      number_field<&P::floor_m>("floor_m", "m", 0.0, 1.0, "match tolerance at least; 0 = auto"),
      number_field<&P::max_belt_distance_m>(
          "max_belt_distance_m", "m", 0.0, 10.0,
          "part's lowest point from the belt, on which it must stand; 0 = off"),
  };
  return kFields;
}

double least_accepted_worth(const VerdictParams& params) noexcept {
  const double outline = std::max(kTestable, 1.0 - params.min_edge);
  return params.min_fitness * (1.0 - params.max_unknown) - 2.0 * params.max_seen_through -
         0.5 * std::min(1.0, params.max_unexplained) - 0.5 * outline - 1e-9;
}

namespace {

/// Only what is seen beside a part says how high above it the part's unseen underside may be. Of a
/// part that shows one flat face nothing else does, and what looks like it may be anything.
void check_ground(const Findings& findings, bool flat, Checks& checks) noexcept {
  const GroundBeside& ground = findings.ground;
  const double gap_m = findings.resting.lowest_m - ground.level_m;
  const double height_m = findings.resting.highest_m - findings.resting.lowest_m;
  const bool below = gap_m >= -kMiddle * height_m;
  if (flat) checks.at_least(Check::Height, below ? ground.share : 0.0, kBeltAround, 1.0);
  if (ground.share < kBeltAround) return;
  double limit_m = std::max(findings.ground_tolerance_m, kHeightKnown * height_m);
  if (gap_m > 0.0 && !findings.closed) limit_m += kCutOff * findings.diameter_m;
  const bool borne = gap_m > limit_m && ground.borne >= kBorne;
  if (borne || !below) {
    checks.record(Check::Ground, std::fabs(gap_m));
  } else {
    checks.at_most(Check::Ground, std::fabs(gap_m), limit_m);
  }
}

}  // namespace

void pass_verdict(const Findings& findings, const VerdictParams& params,
                  RegistrationReport& report) noexcept {
  const Evidence& evidence = findings.evidence;
  const double square_m2 = findings.diameter_m * findings.diameter_m;
  const double min_area_m2 = params.min_area_m2 > 0.0 ? params.min_area_m2 : 0.01 * square_m2;
  const double max_hole_m2 = params.max_hole_m2 > 0.0 ? params.max_hole_m2 : square_m2 / 500.0;
  const double read = 1.0 - evidence.unknown;
  const double fitness = read > 0.0 ? evidence.matched / read : 0.0;
  report.fitness = fitness;
  report.rmse_m = evidence.rmse_m;
  report.coverage = evidence.coverage;
  report.free_space_violation = evidence.seen_through;
  report.occluded = evidence.occluded;
  report.unknown = evidence.unknown;
  report.margin = findings.margin;
  report.sigma_m = findings.sigma_m;
  report.sigma_rad = findings.sigma_rad;

  Checks checks(report);
  checks.at_least(Check::MatchedShare, fitness, params.min_fitness, 1.0);
  checks.at_least(Check::MatchedArea, evidence.matched_area_m2, min_area_m2, 10.0 * min_area_m2);
  checks.at_most(Check::SeenThrough, evidence.seen_through, params.max_seen_through);
  if (evidence.hole_area_m2 > max_hole_m2 && evidence.seen_through <= params.max_seen_through) {
    checks.at_most(Check::Hole, evidence.hole_area_m2, max_hole_m2);
  }
  checks.at_most(Check::Stray, evidence.stray_area_m2, max_hole_m2);
  checks.at_most(Check::Deviation, evidence.rmse_m, params.max_rmse_ratio * findings.tolerance_m);
  checks.at_most(Check::Unknown, evidence.unknown, params.max_unknown);
  checks.at_most(Check::Outside, findings.outside, params.max_outside);
  checks.at_most(Check::Unexplained, evidence.unexplained, params.max_unexplained);
  checks.at_least(Check::Explained, evidence.explained, params.min_explained, 1.0);
  if (params.max_left_over > 0.0) {
    checks.at_most(Check::LeftOver, findings.left_over_m2, params.max_left_over * square_m2);
  }
  checks.at_least(Check::OutlineKnown, evidence.edge_known, params.min_edge_known, 1.0);
  if (evidence.edge_known > kTestable) {
    checks.at_least(Check::Outline, evidence.edge, params.min_edge, 1.0);
  }
  const bool flat = evidence.second_face < params.min_second_face;
  if (flat) {
    checks.at_least(Check::FlatProof, fitness * evidence.edge * evidence.edge_known,
                    params.min_flat_proof, 1.0);
  }
  checks.at_least(Check::Margin, findings.margin, params.min_margin, 1.0);
  if (findings.has_mirror) {
    checks.at_least(Check::Mirror, findings.mirror_margin, params.min_mirror_margin, 1.0);
  }
  checks.at_most(Check::Shift, findings.sigma_m, params.max_sigma_m);
  checks.at_most(Check::Turn, findings.sigma_rad, params.max_sigma_rad);
  if (findings.has_belt) {
    checks.record(Check::BeltDistance, std::fabs(findings.resting.lowest_m));
    checks.record(Check::Support, findings.resting.support_m);
  }
  if (params.max_belt_distance_m > 0.0 && !findings.has_belt) {
    checks.at_least(Check::BeltKnown, 0.0, 1.0, 1.0);
  } else if (params.max_belt_distance_m > 0.0) {
    checks.at_most(Check::BeltDistance, std::fabs(findings.resting.lowest_m),
                   params.max_belt_distance_m);
    checks.at_least(Check::Support, findings.resting.support_m, 0.0, 0.05 * findings.diameter_m);
  } else if (findings.has_belt) {
    if (evidence.beside_belt >= kBeltAround) {
      checks.at_most(Check::Sunk, std::max(0.0, -findings.resting.lowest_m),
                     kMostSunk * findings.diameter_m);
    }
    check_ground(findings, flat, checks);
  }
  checks.conclude();
}

}  // namespace grapnel
