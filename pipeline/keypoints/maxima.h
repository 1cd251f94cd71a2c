#pragma once

#include <cstddef>
#include <span>

#include "base/arena.h"
#include "pipeline/features.h"
#include "pipeline/limits.h"
#include "pipeline/neighbours/neighbour_search.h"

namespace grapnel {

/// Non-maximum suppression, as PCL's detectors do it: a point stays when no point within the radius
/// has a larger score; equal ones stay together.
class LocalMaxima {
 public:
  void reserve(Arena& arena, const Limits& limits);

  /// Points of the search's surface whose score is at least `threshold` and not exceeded within
  /// `radius_m`, ascending by point, as keypoints of scale `radius_m`. `min_neighbours` > 1: points
  /// with fewer within the radius, themselves included, do not count. Valid until the next call.
  [[nodiscard]] std::span<Keypoint> find(NeighbourSearch& search, std::span<const float> scores,
                                         float threshold, float radius_m,
                                         std::size_t min_neighbours) noexcept;

 private:
  std::span<float> ordered_;  ///< scores in the search's order
  std::span<Keypoint> candidates_;
};

}  // namespace grapnel
