#include "pipeline/correspond/metric.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

#include "base/math.h"

namespace grapnel {
namespace {

template <class Term>
double sum_of(std::span<const double> a, std::span<const double> b, const Term& term) noexcept {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += term(a[i], b[i]);
  return sum;
}

double square(double value) noexcept { return value * value; }
double root(double value) noexcept { return std::sqrt(std::max(value, 0.0)); }

double chi_square_term(double a, double b) noexcept {
  return a + b == 0.0 ? 0.0 : square(a - b) / (a + b);
}

double divergence_term(double a, double b) noexcept {
  if (!(a > 0.0)) return 0.0;
  if (!(b > 0.0)) return std::numeric_limits<double>::infinity();
  return (a - b) * math::log(a / b);
}

double kullback_leibler_term(double a, double b) noexcept {
  return a > 0.0 && b > 0.0 ? a * math::log(a / b) : 0.0;
}

double largest_difference(std::span<const double> a, std::span<const double> b) noexcept {
  double largest = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) largest = std::max(largest, std::fabs(a[i] - b[i]));
  return largest;
}

double bhattacharyya(std::span<const double> a, std::span<const double> b) noexcept {
  const double overlap = sum_of(a, b, [](double x, double y) { return root(x * y); });
  return overlap > 0.0 ? -math::log(overlap) : std::numeric_limits<double>::infinity();
}

double correlation(std::span<const double> a, std::span<const double> b) noexcept {
  const double count = static_cast<double>(a.size());
  const double mean_a = sum_of(a, b, [](double x, double) { return x; }) / count;
  const double mean_b = sum_of(a, b, [](double, double y) { return y; }) / count;
  const double ab = sum_of(a, b, [&](double x, double y) { return (x - mean_a) * (y - mean_b); });
  const double aa = sum_of(a, b, [&](double x, double) { return square(x - mean_a); });
  const double bb = sum_of(a, b, [&](double, double y) { return square(y - mean_b); });
  return aa > 0.0 && bb > 0.0 ? 1.0 - ab / std::sqrt(aa * bb) : 1.0;
}

}  // namespace

double metric_distance(Metric metric, std::span<const double> a, std::span<const double> b,
                       const MetricFactors& f) noexcept {
  const auto squared = [](double x, double y) { return square(x - y); };
  const auto scaled = [&f](double x, double y) { return f.source * x - f.target * y; };
  switch (metric) {
    case Metric::L2:
      return std::sqrt(sum_of(a, b, squared));
    case Metric::L2Squared:
      return sum_of(a, b, squared);
    case Metric::L1:
      return sum_of(a, b, [](double x, double y) { return std::fabs(x - y); });
    case Metric::LInfinity:
      return largest_difference(a, b);
    case Metric::JeffriesMatusita:
      return std::sqrt(sum_of(a, b, [](double x, double y) { return square(root(x) - root(y)); }));
    case Metric::Bhattacharyya:
      return bhattacharyya(a, b);
    case Metric::Sublinear:
      return sum_of(a, b, [](double x, double y) { return std::sqrt(std::fabs(x - y)); });
    case Metric::ChiSquare:
      return sum_of(a, b, chi_square_term);
    case Metric::Divergence:
      return sum_of(a, b, divergence_term);
    case Metric::Pf:
      return std::sqrt(sum_of(a, b, [&](double x, double y) { return square(scaled(x, y)); }));
    case Metric::K:
      return sum_of(a, b, [&](double x, double y) { return std::fabs(scaled(x, y)); });
    case Metric::KullbackLeibler:
      return sum_of(a, b, kullback_leibler_term);
    case Metric::Intersection:
      return 1.0 - sum_of(a, b, [](double x, double y) { return std::min(x, y); });
    case Metric::Correlation:
      return correlation(a, b);
  }
  return 0.0;
}

bool compares_distributions(Metric metric) noexcept {
  switch (metric) {
    case Metric::JeffriesMatusita:
    case Metric::Bhattacharyya:
    case Metric::ChiSquare:
    case Metric::Divergence:
    case Metric::KullbackLeibler:
    case Metric::Intersection:
      return true;
    default:
      return false;
  }
}

}  // namespace grapnel
