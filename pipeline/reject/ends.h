#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>

#include "base/arena.h"
#include "base/geometry.h"
#include "pipeline/kernels/rigid_pairs.h"
#include "pipeline/stage.h"

namespace grapnel {

/// Index of the surface point a pair starts or ends at.
[[nodiscard]] inline std::size_t source_point(const PairView& pair,
                                              const Correspondence& c) noexcept {
  return static_cast<std::size_t>(pair.source_keypoints[static_cast<std::size_t>(c.source)].point);
}
[[nodiscard]] inline std::size_t target_point(const PairView& pair,
                                              const Correspondence& c) noexcept {
  return static_cast<std::size_t>(pair.target_keypoints[static_cast<std::size_t>(c.target)].point);
}

/// What pairs are sorted by: a distance that is no number is the farthest.
[[nodiscard]] inline float sort_key(const Correspondence& c) noexcept {
  return std::isnan(c.distance) ? std::numeric_limits<float>::infinity() : c.distance;
}

/// The ends of all pairs side by side, each side about its first pair's point, so that single
/// precision is enough however far the clouds are from their origins.
class PairEnds {
 public:
  void reserve(Arena& arena, std::size_t max_pairs);
  /// False when there are more pairs than room.
  [[nodiscard]] bool gather(const PairView& pair, const Correspondences& pairs) noexcept;

  [[nodiscard]] std::size_t size() const noexcept { return size_; }
  [[nodiscard]] Vec3f source(std::size_t i) const noexcept {
    return {planes_[0][i], planes_[1][i], planes_[2][i]};
  }
  [[nodiscard]] Vec3f target(std::size_t i) const noexcept {
    return {planes_[3][i], planes_[4][i], planes_[5][i]};
  }
  [[nodiscard]] kernels::PairPlanes planes() const noexcept;

 private:
  std::array<std::span<float>, 6> planes_;  // source x, y, z, target x, y, z
  std::size_t size_ = 0;
};

}  // namespace grapnel
