#pragma once

#include <cstdint>

#include "base/depth_frame.h"
#include "base/error.h"
#include "base/field.h"
#include "pipeline/preprocess/depth_gap.h"
#include "pipeline/preprocess/working_depth.h"
#include "pipeline/surface.h"

namespace grapnel {

struct DecimateParams {
  double resolution_m = 0.0;  ///< wanted distance of neighbouring points; 0 = auto: target_points
  int target_points = 6000;   ///< wanted number of points when the resolution is auto
  double min_fill_ratio = 0.25;  ///< of a block's pixels that must agree for a point
  DepthGapParams gap;
};

[[nodiscard]] FieldTable decimate_fields() noexcept;

/// Largest stride; a coarser resolution than this gives is not to be had from a grid.
inline constexpr int kMaxStride = 16;

/// One point a block of stride × stride pixels: the centroid of the pixels that lie within the
/// depth gap of the block's median. The stride follows from the resolution at the mean depth,
/// and grows until the points fit the surface. Grid, viewpoint and spacing_m are set, normals are
/// zero, intensity comes from `color` (empty = unknown; pixels of the whole frame).
/// `label` selects a component; kForeground takes every labelled pixel. `resolution_m` > 0 goes
/// before the parameters'. Returns the stride.
/// Errors: TooFewPoints (nothing selected or agreeing), CapacityExceeded.
[[nodiscard]] Result<int> decimate(const WorkingDepth& work, std::uint8_t label,
                                   ImageView<const Rgb8> color, const DecimateParams& params,
                                   double resolution_m, Surface& out) noexcept;

}  // namespace grapnel
