#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <string_view>

#include "pipeline/neighbours/neighbour_search.h"
#include "pipeline/stage.h"

namespace grapnel {

/// Choices of an `engine` key, in the order of Engine.
inline constexpr std::array<std::string_view, 2> kEngineNames = {"fast", "reference"};

/// What every descriptor does first: checks that the rows fit, resolves the radius (metres, or in
/// spacings where `radius_m` is 0), builds the search and sets one row of zeros a keypoint. Returns
/// the radius in metres. Errors: CapacityExceeded, BadParameter, TooFewPoints.
[[nodiscard]] Result<float> begin_description(const Surface& surface,
                                              std::span<const Keypoint> keypoints, double radius_m,
                                              double radius_ratio, std::size_t dimension,
                                              FeatureMatrix& features,
                                              NeighbourSearch& search) noexcept;

/// Bin of `value` in `bins` equal parts of low…high, the ends' where it lies outside.
[[nodiscard]] std::size_t bin_of(double value, double low, double high, std::size_t bins) noexcept;

}  // namespace grapnel
