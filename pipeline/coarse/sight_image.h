#pragma once

#include <span>

#include "base/arena.h"
#include "pipeline/judge/depth_view.h"
#include "pipeline/kernels/pose_rating.h"

namespace grapnel {

/// A view's depth image as ratings look it up: metres, 0 = no reading, negative where the reading
/// is of the background.
class SightImage {
 public:
  void reserve(Arena& arena, std::size_t max_pixels);
  /// O(pixels).
  void build(const DepthView& view) noexcept;

  [[nodiscard]] const kernels::SignedDepth& pixels() const noexcept { return pixels_; }

 private:
  std::span<float> z_;
  kernels::SignedDepth pixels_;
};

}  // namespace grapnel
