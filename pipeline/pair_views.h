#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "pipeline/pair_state.h"
#include "pipeline/surface.h"

namespace grapnel {

/// Hash of all points. O(n).
[[nodiscard]] std::uint64_t hash_of(const Surface& surface, std::uint64_t seed) noexcept;

/// Points and attributes without the grid. False when they do not fit.
bool copy_points(const Surface& from, Surface& to) noexcept;

/// The most pixels both ways of a block, as ViewGrid has them, that is clearly smaller than a cell
/// of `leaf_m` at the distance of `centre` from the camera; 1 for a cloud.
[[nodiscard]] int stride_for(const Surface& raw, const Vec3d& centre, double leaf_m) noexcept;

/// Fills the view's centre and size from some thousands of the points, at least one. O(1).
void measure(const Surface& raw, ViewIndex& view) noexcept;

/// Every n-th point with its normal, without the grid, in the memory of another surface from its
/// `begin`-th point on, where there must be room.
[[nodiscard]] Surface every_nth(const Surface& surface, std::size_t n, std::size_t begin,
                                const Surface& memory) noexcept;

/// Whether one of the first `size` elements is not 0. O(n).
[[nodiscard]] bool any_set(const std::span<float>& plane, std::size_t size) noexcept;

/// Whether a point has a normal. O(n).
[[nodiscard]] bool any_normal(const Surface& surface) noexcept;

}  // namespace grapnel
