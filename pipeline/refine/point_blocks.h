#pragma once

#include <cstddef>
#include <cstdint>

#include "pipeline/kernels/surface_pairs.h"
#include "pipeline/refine/normal_equations.h"
#include "pipeline/surface.h"

namespace grapnel {

/// The eight parts of a kernel's sum, added up in their fixed order.
[[nodiscard]] inline double sum_of(const float (&parts)[kernels::kLanes]) noexcept {
  return static_cast<double>(kernels::fold_lanes(parts));
}

[[nodiscard]] inline kernels::OrientedPlanes planes_of(const Surface& surface) noexcept {
  return {surface.x.data(),  surface.y.data(),  surface.z.data(),
          surface.nx.data(), surface.ny.data(), surface.nz.data()};
}

/// The next of `size` points, every `step`-th from `first`, filled up to whole lanes; returns where
/// to go on.
std::size_t take_block(const kernels::OrientedPlanes& points, std::size_t size, std::size_t first,
                       std::size_t step, kernels::PointBlock& block) noexcept;

struct PlanePairs {
  double square_m2 = 0.0;  ///< sum of the squared residuals
  std::uint32_t count = 0;
};
/// Adds a block's pairs, error along the fixed surface's normals, to the equations of the block's
/// own motion. The equations' centre is the gate's.
PlanePairs add_plane_pairs(const kernels::PointBlock& block, const kernels::OrientedPlanes& fixed,
                           const kernels::PairGate& gate, NormalEquations& equations) noexcept;

}  // namespace grapnel
