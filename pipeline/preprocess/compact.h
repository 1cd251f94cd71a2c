#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "base/error.h"
#include "pipeline/surface.h"

namespace grapnel {

/// Removes the points whose `keep` is 0, in place, in order; the grid follows. Returns how many
/// went. O(n).
std::size_t keep_points(Surface& surface, std::span<const std::uint8_t> keep) noexcept;

/// What every filter refuses: an empty surface (TooFewPoints), more than `capacity` points
/// (CapacityExceeded), a coordinate that is no finite number (BadParameter, with the point). O(n).
[[nodiscard]] Status check_points(const Surface& surface, std::size_t capacity,
                                  Stage stage) noexcept;

/// Makes an unorganised surface of an organised one.
void drop_grid(Surface& surface) noexcept;

}  // namespace grapnel
