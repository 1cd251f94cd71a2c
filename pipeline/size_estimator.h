#pragma once

#include <cstddef>

#include "base/arena.h"
#include "base/rng.h"
#include "pipeline/coarse/plane_patches.h"
#include "pipeline/ground.h"
#include "pipeline/size_estimate.h"
#include "pipeline/surface.h"

namespace grapnel {

/// Measures one object cut out of a frame. A barrel when a cylinder holds more of its points than
/// planes do; a box when perpendicular planes hold most of them.
class SizeEstimator {
 public:
  void reserve(Arena& arena, std::size_t max_points) { planes_.reserve(arena, max_points); }
  /// O(points), a fixed number of trials.
  [[nodiscard]] SizeEstimate estimate(const Surface& object, const Ground& ground,
                                      Rng rng) noexcept;

 private:
  [[nodiscard]] SizeEstimate box(const Surface& object, const Ground& ground) noexcept;

  PlanePatches planes_;
};

}  // namespace grapnel
