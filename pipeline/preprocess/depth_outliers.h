#pragma once

#include <cstddef>
#include <cstdint>

#include "base/arena.h"
#include "base/field.h"
#include "pipeline/limits.h"
#include "pipeline/preprocess/depth_gap.h"
#include "pipeline/preprocess/padded_depth.h"
#include "pipeline/preprocess/working_depth.h"

namespace grapnel {

struct DepthOutlierParams {
  bool enabled = true;
  /// Of the eight neighbours, how many must lie on the same surface. Flying pixels between two
  /// surfaces and rays that graze a surface have fewer.
  int min_support = 3;
  DepthGapParams gap;
};

[[nodiscard]] FieldTable depth_outlier_fields() noexcept;

/// Removes flying and grazing pixels: depth and label become 0. One that mixes two surfaces at an
/// edge, which lies between its neighbours in depth, takes the depth of the surface that more of
/// its neighbours lie on, where at least min_support do: left out, it would move the edge inwards,
/// and only on the sides where the sensor reads both surfaces.
class DepthOutliers {
 public:
  explicit DepthOutliers(const DepthOutlierParams& params) noexcept : params_(params) {}

  void reserve(Arena& arena, const Limits& limits);
  /// Pixels removed.
  std::size_t apply(WorkingDepth& work) noexcept;

 private:
  /// Looks again at what was taken out of row v; pixels that got a depth.
  std::size_t put_on_surfaces(const DepthGap& gap, int v, WorkingDepth& work) const noexcept;

  DepthOutlierParams params_;
  PaddedDepth padded_;
};

}  // namespace grapnel
