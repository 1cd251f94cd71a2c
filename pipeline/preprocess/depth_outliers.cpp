#include "pipeline/preprocess/depth_outliers.h"

#include <array>

#include "pipeline/kernels/depth_rows.h"

namespace grapnel {

FieldTable depth_outlier_fields() noexcept {
  static constexpr std::array kFields = {
      bool_field<&DepthOutlierParams::enabled>("enabled", "remove flying and grazing pixels"),
      number_field<&DepthOutlierParams::min_support>(
          "min_support", "", 0, 8, "of the eight neighbours, how many must lie on the surface"),
  };
  return kFields;
}

void DepthOutliers::reserve(Arena& arena, const Limits& limits) { padded_.reserve(arena, limits); }

std::size_t DepthOutliers::apply(WorkingDepth& work) noexcept {
  if (!params_.enabled) return 0;
  const DepthGap gap(params_.gap, work.intrinsics, work.metres_per_unit);
  padded_.copy(work.depth);
  std::size_t removed = 0;
  for (int v = 0; v < work.depth.height; ++v) {
    std::uint16_t* row = work.depth.row(v);
    const std::size_t in_row = kernels::support_row(
        padded_.row(v - 1, 1), padded_.row(v, 1), padded_.row(v + 1, 1), gap.law(),
        params_.min_support, static_cast<std::size_t>(work.depth.width), row);
    removed += in_row;
    if (in_row == 0) continue;
    std::uint8_t* label = work.label.row(v);
    for (int u = 0; u < work.depth.width; ++u) {
      if (row[u] == 0) label[u] = kNoLabel;
    }
  }
  return removed;
}

}  // namespace grapnel
