#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "base/arena.h"
#include "base/geometry.h"
#include "pipeline/kernels/pose_rating.h"
#include "pipeline/refine/closest_point_table.h"
#include "pipeline/surface.h"

namespace grapnel {

/// Distance to a surface by one look-up of a byte: coarse, but small enough to stay near the
/// processor while thousands of poses are rated.
class DistanceField {
 public:
  static constexpr int kSide = 56;

  void reserve(Arena& arena);
  /// Covers the surface and a margin on every side; distances beyond `reach_m` count as far.
  /// O(kSide³).
  void build(const Surface& surface, const ClosestPointTable& table, double margin_m,
             double reach_m) noexcept;

  /// For kernels: a level for each voxel, whose worth is 1 on the surface and falls with the square
  /// of the distance to 0 at `reach_m`.
  [[nodiscard]] kernels::LevelField levels() const noexcept {
    return {{{origin_.x(), origin_.y(), origin_.z()}, per_metre_, {kSide, kSide, kSide}},
            values_.data(),
            worth_.data()};
  }
  [[nodiscard]] bool built() const noexcept { return per_metre_ > 0.0F; }

 private:
  static constexpr std::size_t kLevels = 33;

  std::span<std::uint8_t> values_;  // level, 0 = on the surface
  std::array<float, kLevels> worth_{};
  Vec3f origin_ = Vec3f::Zero();
  float per_metre_ = 0.0F;
};

}  // namespace grapnel
