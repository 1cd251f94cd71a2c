#pragma once

#include "base/field.h"
#include "base/geometry.h"
#include "pipeline/judge/ground_beside.h"
#include "pipeline/judge/resting.h"
#include "pipeline/judge/verification.h"
#include "pipeline/report.h"

namespace grapnel {

/// Limits of acceptance. Zero switches a check off where the help says so.
struct VerdictParams {
  double min_fitness = 0.70;
  double min_area_m2 = 0.0;      ///< 0 = auto: a hundredth of the squared diameter
  double max_rmse_ratio = 0.75;  ///< of the match tolerance
  double max_seen_through = 0.03;
  double max_hole_m2 = 0.0;  ///< 0 = auto: a five-hundredth of the squared diameter
  double max_unknown = 0.25;
  double max_outside = 0.3;  ///< of the visible model, beyond the image's ends
  double max_unexplained = 0.15;
  double min_explained = 0.0;  ///< of the whole measured object
  double max_left_over = 0.0;  ///< squared diameters: largest piece of it beside the model; 0 = off
  double min_edge = 0.60;
  double min_edge_known = 0.0;
  double min_second_face = 0.10;  ///< a match with less off its main direction is flat
  double min_flat_proof = 0.65;   ///< fitness × proven share of the outline, of a flat match
  double min_margin = 0.10;
  double min_mirror_margin = 0.10;  ///< to the mirror image of a part that differs from it; 0 = off
  double max_sigma_m = 0.002;
  double max_sigma_rad = 0.0175;
  double floor_m = 0.0;              ///< match tolerance at the least; 0 = auto
  double max_belt_distance_m = 0.0;  ///< 0 = off
};
[[nodiscard]] FieldTable verdict_fields() noexcept;

/// A pose of less worth() fails one of these limits, whatever else is found out about it.
[[nodiscard]] double least_accepted_worth(const VerdictParams& params) noexcept;

/// Everything the verdict rests on.
struct Findings {
  Evidence evidence;
  double margin = 0.0;
  bool has_mirror = false;     ///< the part differs from its mirror image, and that was looked at
  double mirror_margin = 0.0;  ///< to it, like margin
  double sigma_m = 0.0;
  double sigma_rad = 0.0;
  double diameter_m = 0.0;
  double tolerance_m = 0.0;   ///< of a match, at the object's distance
  double outside = 0.0;       ///< share of the visible model beyond the image's ends
  double left_over_m2 = 0.0;  ///< largest piece that the pose leaves over
  bool has_belt = false;
  Resting resting;  ///< on the belt
  GroundBeside ground;
  double ground_tolerance_m = 0.0;  ///< of the underside's distance from that ground
  bool closed = false;              ///< the model shows the part's underside
};

/// Fills verdict, code, reasons, quality and the report's figures. Accepted only when every check
/// passes.
void pass_verdict(const Findings& findings, const VerdictParams& params,
                  RegistrationReport& report) noexcept;

}  // namespace grapnel
