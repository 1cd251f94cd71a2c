#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "pipeline/surface.h"

namespace grapnel {

/// Removes the points whose `keep` is 0, in place, in order; the grid follows. Returns how many
/// went. O(n).
std::size_t keep_points(Surface& surface, std::span<const std::uint8_t> keep) noexcept;

/// Makes an unorganised surface of an organised one.
void drop_grid(Surface& surface) noexcept;

}  // namespace grapnel
