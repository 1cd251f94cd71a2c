#pragma once

#include <cstddef>
#include <cstdint>

#include "base/field.h"
#include "base/geometry.h"
#include "pipeline/refine/closest_point_table.h"
#include "pipeline/report.h"
#include "pipeline/surface.h"

namespace grapnel {

/// Where a surface's points lie: their middle and their root mean square distance from it.
struct PointSpread {
  Vec3d centre = Vec3d::Zero();
  double arm_m = 0.0;  ///< 0 = not known
};
[[nodiscard]] PointSpread spread_of(const Surface& surface) noexcept;

/// One of two views as the overlap test sees it.
struct OverlapView {
  const Surface* raw = nullptr;              ///< as measured, with its grid where a camera gave one
  const Surface* fine = nullptr;             ///< thinned, with normals
  const ClosestPointTable* table = nullptr;  ///< indexes `fine`
  PointSpread spread;                        ///< of `fine`, or of all whose part `fine` is
};

/// What one view says about the other's points at a pose. Counts of points.
struct OverlapEvidence {
  double points = 0.0;
  double matched = 0.0;
  double misaligned = 0.0;    ///< a surface is there, but it faces elsewhere
  double seen_through = 0.0;  ///< the other camera looks through the point
  double hidden = 0.0;        ///< behind what the other camera saw: says nothing
  double unknown = 0.0;       ///< no reading there
  double square_m2 = 0.0;     ///< sum of squared point-to-plane distances of matched points
  /// Matched share of what would notice a motion, for the motion that least of it noticed: see
  /// least_matched_share().
  double least_share = 0.0;

  [[nodiscard]] double matched_share() const noexcept;  ///< of the points that should be seen
  [[nodiscard]] double seen_through_share() const noexcept;
  [[nodiscard]] double overlap() const noexcept;  ///< matched share of all points
};

/// Noise of a reading and the least tolerance of a match.
struct OverlapTolerance {
  double sigma_per_m2 = 0.001425;  ///< axial, grows with z² (Khoshelham and Elberink 2012)
  double floor_m = 0.004;
};

/// Tests the points of `moved` against `fixed`. Where `fixed` has a camera's grid: by its depth
/// image, free space included. Else by distance alone: then nothing is ever seen through.
[[nodiscard]] OverlapEvidence test_overlap(const OverlapView& moved, const OverlapView& fixed,
                                           const Pose& fixed_from_moved,
                                           const OverlapTolerance& tolerance) noexcept;

/// Worth of a pose for comparing candidates, both directions.
[[nodiscard]] double worth(const OverlapEvidence& forward, const OverlapEvidence& back) noexcept;

/// Limits of acceptance for pairs of views.
struct OverlapParams {
  double min_matched = 0.75;
  double min_least_share = 0.6;
  double min_overlap = 0.12;
  double min_area_ratio = 0.03;
  double max_seen_through = 0.10;
  double max_rmse_ratio = 0.75;
  double min_margin = 0.50;
  double max_sigma_ratio = 0.02;
  double max_sigma_m = 0.0022;  ///< whatever the size; 0 = off
  double max_sigma_rad = 0.02;
};
[[nodiscard]] FieldTable overlap_fields() noexcept;

/// Everything the verdict on a pair rests on.
struct OverlapFindings {
  OverlapEvidence forward;  ///< source's points in the target
  OverlapEvidence back;     ///< target's points in the source
  double margin = 0.0;
  double sigma_m = 0.0;
  double sigma_rad = 0.0;
  double size_m = 0.0;       ///< of the smaller view
  double spacing_m = 0.0;    ///< of the fine surfaces
  double tolerance_m = 0.0;  ///< of a match, at the overlap's distance
};

/// Fills verdict, code, reasons and the report's figures; the worse of the two directions counts.
void pass_overlap_verdict(const OverlapFindings& findings, const OverlapParams& params,
                          RegistrationReport& report) noexcept;

}  // namespace grapnel
