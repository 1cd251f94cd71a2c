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

/// Removes flying and grazing pixels: depth and label become 0.
class DepthOutliers {
 public:
  explicit DepthOutliers(const DepthOutlierParams& params) noexcept : params_(params) {}

  void reserve(Arena& arena, const Limits& limits);
  /// Pixels removed.
  std::size_t apply(WorkingDepth& work) noexcept;

 private:
  DepthOutlierParams params_;
  PaddedDepth padded_;
};

}  // namespace grapnel
