#pragma once

#include <cstddef>

#include "base/depth_frame.h"
#include "base/error.h"
#include "base/field.h"
#include "pipeline/preprocess/working_depth.h"

namespace grapnel {

struct OrganizeParams {
  int roi_left_px = 0;
  int roi_top_px = 0;
  int roi_width_px = 0;   ///< 0 = to the right edge
  int roi_height_px = 0;  ///< 0 = to the lower edge
  double min_z_m = 0.0;
  double max_z_m = 0.0;  ///< 0 = no limit
};

[[nodiscard]] FieldTable organize_fields() noexcept;

/// Copies the region of interest into the workspace; depths outside the range become 0. Labels are
/// kForeground where a reading is. Returns the readings kept. Errors: CapacityExceeded (frame
/// larger than the limits), RoiEmpty (the region lies outside the frame), BadParameter (no
/// intrinsics).
[[nodiscard]] Result<std::size_t> organize(const DepthFrame& frame, const OrganizeParams& params,
                                           WorkingDepth& out) noexcept;

}  // namespace grapnel
