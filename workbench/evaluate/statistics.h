#pragma once

#include <cstddef>
#include <vector>

namespace grapnel {

/// The `share` quantile (0…1) with linear interpolation between order statistics (type 7 of
/// Hyndman and Fan 1996); NaN for an empty list. O(n log n).
[[nodiscard]] double quantile(std::vector<double> values, double share);

/// Bounds of a rate, 0…1.
struct Interval {
  double low = 0.0;
  double high = 1.0;
};

/// Wilson 1927, two-sided 95 %, for `hits` of `trials`; 0…1 when there was no trial.
[[nodiscard]] Interval wilson_95(std::size_t hits, std::size_t trials);

/// Clopper and Pearson 1934: the rate that `hits` of `trials` still allows with 95 % confidence,
/// one-sided; 1 when there was no trial. For no hits about 3 / trials.
[[nodiscard]] double upper_bound_95(std::size_t hits, std::size_t trials);

}  // namespace grapnel
