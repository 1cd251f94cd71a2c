#pragma once

#include <algorithm>
#include <cstddef>

namespace grapnel {

/// Step through `size` points that spreads at most `max_points` evenly; `max_points` 0: all points.
[[nodiscard]] constexpr std::size_t point_step(std::size_t size, std::size_t max_points) noexcept {
  if (max_points == 0) return 1;
  return std::max<std::size_t>(1, (size + max_points - 1) / max_points);
}

}  // namespace grapnel
