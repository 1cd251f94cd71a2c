#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "base/cloud.h"

namespace grapnel {

/// Names of the filters that work on a camera's grid.
[[nodiscard]] bool is_depth_filter(const std::string& method) noexcept;
inline constexpr const char* kDepthFilterNames = "median, flying_pixels";

/// Runs "median" (each depth becomes the median of its window; the point stays on its ray) or
/// "flying_pixels" (points between two surfaces go to the one that most of their neighbours lie on,
/// points on none lose their reading) on an organised cloud, in place. Returns the points removed.
/// Throws InputError: no grid, unknown key.
std::size_t filter_depth(CloudData& cloud, const std::string& method,
                         const std::vector<std::string>& overrides);

}  // namespace grapnel
