#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "base/arena.h"
#include "base/error.h"
#include "pipeline/neighbours/cell_index.h"
#include "pipeline/stage.h"

namespace grapnel {

/// Exact nearest points of an unorganised cloud by its cells: cheap to build, for clouds that are
/// met once.
class ClosestInCells final : public ClosestSurface {
 public:
  void reserve(Arena& arena, std::size_t max_points);

  /// Indexes `surface`, which must stay where it is; `typical_m` is about the distance at which
  /// partners are expected. Errors: TooFewPoints, CapacityExceeded, BadParameter (not finite).
  /// O(n).
  [[nodiscard]] Status build(const Surface& surface, double typical_m) noexcept;

  [[nodiscard]] std::int32_t closest(const Vec3f& p, float max_distance_m) const noexcept override;

 private:
  CellIndex cells_;
  std::span<float> x_, y_, z_;  // in the order of the cells
  float step_m_ = 0.0F;
};

}  // namespace grapnel
