#pragma once

#include <cstdint>

#include "base/arena.h"
#include "base/field.h"
#include "pipeline/limits.h"
#include "pipeline/preprocess/padded_depth.h"
#include "pipeline/preprocess/row_bands.h"
#include "pipeline/preprocess/working_depth.h"

namespace grapnel {

enum class MedianWindow : std::uint8_t { Off, Three, Five };

struct DepthMedianParams {
  MedianWindow window = MedianWindow::Five;
};

[[nodiscard]] FieldTable depth_median_fields() noexcept;

/// Median of the readings in the window (upper one of an even count); pixels without a reading stay
/// without. Works on counts, so that points stay on their rays.
class DepthMedian {
 public:
  explicit DepthMedian(const DepthMedianParams& params) noexcept : params_(params) {}

  void reserve(Arena& arena, const Limits& limits);
  void apply(WorkingDepth& work) noexcept;
  /// The same for the pixels of the bands alone; the others keep their readings.
  void apply(WorkingDepth& work, const RowBands& bands) noexcept;

 private:
  DepthMedianParams params_;
  PaddedDepth padded_;
  RowBands all_;
};

}  // namespace grapnel
