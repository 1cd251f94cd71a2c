#include "workbench/evaluate/statistics.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/math.h"

namespace grapnel {
namespace {

double log_of(std::size_t value) { return math::log(static_cast<double>(value)); }

/// P(at most `hits` of `trials`) at rate `rate`, 0 < rate < 1.
double binomial_cdf(std::size_t hits, std::size_t trials, double rate) {
  const double log_rate = math::log(rate);
  const double log_rest = math::log(1.0 - rate);
  double log_choose = 0.0;
  double sum = 0.0;
  for (std::size_t k = 0; k <= hits; ++k) {
    if (k > 0) log_choose += log_of(trials - k + 1) - log_of(k);
    sum += math::exp(log_choose + static_cast<double>(k) * log_rate +
                     static_cast<double>(trials - k) * log_rest);
  }
  return sum;
}

}  // namespace

double quantile(std::vector<double> values, double share) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  std::sort(values.begin(), values.end());
  const double place = share * static_cast<double>(values.size() - 1);
  const std::size_t below = static_cast<std::size_t>(std::floor(place));
  const std::size_t above = std::min(below + 1, values.size() - 1);
  return values[below] + (place - std::floor(place)) * (values[above] - values[below]);
}

Interval wilson_95(std::size_t hits, std::size_t trials) {
  if (trials == 0) return {};
  constexpr double kZ = 1.959963984540054;  // 97.5 % quantile of the normal distribution
  const double n = static_cast<double>(trials);
  const double rate = static_cast<double>(hits) / n;
  const double scale = 1.0 / (1.0 + kZ * kZ / n);
  const double centre = scale * (rate + kZ * kZ / (2.0 * n));
  const double half = scale * kZ * std::sqrt(rate * (1.0 - rate) / n + kZ * kZ / (4.0 * n * n));
  return {std::max(0.0, centre - half), std::min(1.0, centre + half)};
}

double upper_bound_95(std::size_t hits, std::size_t trials) {
  if (hits >= trials) return 1.0;
  double low = static_cast<double>(hits) / static_cast<double>(trials);
  double high = 1.0;
  for (int step = 0; step < 60; ++step) {
    const double middle = 0.5 * (low + high);
    (middle < 1.0 && binomial_cdf(hits, trials, middle) > 0.05 ? low : high) = middle;
  }
  return high;
}

}  // namespace grapnel
