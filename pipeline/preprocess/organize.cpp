#include "pipeline/preprocess/organize.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "pipeline/kernels/label_rows.h"

namespace grapnel {

FieldTable organize_fields() noexcept {
  static constexpr std::array kFields = {
      number_field<&OrganizeParams::roi_left_px>("roi_left_px", "px", 0, 4095,
                                                 "region of interest: first column"),
      number_field<&OrganizeParams::roi_top_px>("roi_top_px", "px", 0, 4095,
                                                "region of interest: first row"),
      number_field<&OrganizeParams::roi_width_px>("roi_width_px", "px", 0, 4096,
                                                  "region of interest: columns; 0 = to the edge"),
      number_field<&OrganizeParams::roi_height_px>("roi_height_px", "px", 0, 4096,
                                                   "region of interest: rows; 0 = to the edge"),
      number_field<&OrganizeParams::min_z_m>("min_z_m", "m", 0.0, 100.0,
                                             "nearest depth that counts"),
      number_field<&OrganizeParams::max_z_m>("max_z_m", "m", 0.0, 100.0,
                                             "farthest depth that counts; 0 = no limit"),
  };
  return kFields;
}

namespace {

constexpr Stage kStage = Stage::Organize;

/// Counts that are readings; none where the first is above the last.
struct Range {
  std::uint16_t least = 1;
  std::uint16_t most = 0xffff;
};

Range range_in_counts(const OrganizeParams& params, double metres_per_unit) noexcept {
  // A limit written in metres that means a whole count may miss it by rounding.
  constexpr double kRounding = 1e-6;
  const double least = std::max(1.0, std::ceil(params.min_z_m / metres_per_unit - kRounding));
  const double most =
      params.max_z_m > 0.0 ? std::floor(params.max_z_m / metres_per_unit + kRounding) : 65535.0;
  if (!(least <= std::min(most, 65535.0))) return {0xffff, 0};
  return {static_cast<std::uint16_t>(least), static_cast<std::uint16_t>(std::min(most, 65535.0))};
}

}  // namespace

Result<std::size_t> organize(const DepthFrame& frame, const OrganizeParams& params,
                             WorkingDepth& out) noexcept {
  if (frame.depth.empty()) return Error{Code::RoiEmpty, kStage, 0};
  if (!frame.intrinsics.valid() || !(frame.metres_per_unit > 0.0)) {
    return Error{Code::BadParameter, kStage, 0};
  }
  const int left = params.roi_left_px;
  const int top = params.roi_top_px;
  const int right = params.roi_width_px > 0
                        ? std::min(frame.depth.width, left + params.roi_width_px)
                        : frame.depth.width;
  const int bottom = params.roi_height_px > 0
                         ? std::min(frame.depth.height, top + params.roi_height_px)
                         : frame.depth.height;
  const int width = right - left;
  const int height = bottom - top;
  if (width <= 0 || height <= 0) return Error{Code::RoiEmpty, kStage, 0};
  const std::size_t pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  if (height > kMostRows) return Error{Code::CapacityExceeded, kStage, height};
  if (pixels > out.depth_memory.size()) {
    return Error{Code::CapacityExceeded, kStage, static_cast<std::int32_t>(pixels)};
  }

  out.depth = {out.depth_memory.data(), width, height};
  out.label = {out.label_memory.data(), width, height};
  out.left = left;
  out.top = top;
  out.metres_per_unit = frame.metres_per_unit;
  out.intrinsics = frame.intrinsics;
  out.intrinsics.width = width;
  out.intrinsics.height = height;
  out.intrinsics.cx -= left;
  out.intrinsics.cy -= top;

  const Range range = range_in_counts(params, frame.metres_per_unit);
  std::size_t kept = 0;
  static_assert(kNoLabel == 0);
  for (int v = 0; v < height; ++v) {
    kept += kernels::copy_in_range(frame.depth.row(top + v) + left, static_cast<std::size_t>(width),
                                   range.least, range.most, kForeground, out.depth.row(v),
                                   out.label.row(v));
  }
  return kept;
}

}  // namespace grapnel
