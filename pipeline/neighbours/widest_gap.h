#pragma once

#include <cstddef>
#include <span>

#include "pipeline/neighbours/neighbour_search.h"
#include "pipeline/surface.h"

namespace grapnel {

/// The widest angle about a point's normal in which none of its neighbours lies, radians: wide at
/// the border of a surface (PCL's BoundaryEstimation). 0 where no neighbour lies elsewhere than the
/// point. `angles` has room for all neighbours. O(n log n) of them.
[[nodiscard]] double widest_gap_rad(const Surface& surface, std::size_t point_i,
                                    const Neighbourhood& around, std::span<float> angles) noexcept;

}  // namespace grapnel
