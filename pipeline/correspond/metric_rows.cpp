#include "pipeline/correspond/metric_rows.h"

#include <algorithm>
#include <cmath>

#include "base/math.h"

namespace grapnel {
namespace {

/// Stands for the logarithm of 0 where a term is to outweigh all others, with products still
/// finite.
constexpr float kFar = 1e30F;

void scaled(std::span<const double> row, double factor, std::span<float> out) noexcept {
  for (std::size_t i = 0; i < row.size(); ++i) out[i] = static_cast<float>(factor * row[i]);
}

void rooted(std::span<const double> row, std::span<float> out) noexcept {
  for (std::size_t i = 0; i < row.size(); ++i) {
    out[i] = static_cast<float>(std::sqrt(std::max(row[i], 0.0)));
  }
}

/// Zero mean and unit length, so that correlation is a product.
void standardised(std::span<const double> row, std::span<float> out) noexcept {
  double mean = 0.0;
  for (const double value : row) mean += value;
  mean /= static_cast<double>(row.size());
  double squared = 0.0;
  for (const double value : row) squared += (value - mean) * (value - mean);
  const double scale = squared > 0.0 ? 1.0 / std::sqrt(squared) : 0.0;
  for (std::size_t i = 0; i < row.size(); ++i) out[i] = static_cast<float>((row[i] - mean) * scale);
}

/// Σ a ln(a/b) = Σ (a ln a) [b > 0] - Σ a ln b, negated for a product to be maximised.
void kullback_leibler(MetricSide side, std::span<const double> row, std::span<float> out) noexcept {
  const std::size_t n = row.size();
  for (std::size_t i = 0; i < n; ++i) {
    const double value = row[i];
    const double logarithm = value > 0.0 ? math::log(value) : 0.0;
    if (side == MetricSide::Source) {
      out[i] = static_cast<float>(-value * logarithm);
      out[n + i] = static_cast<float>(value > 0.0 ? value : 0.0);
    } else {
      out[i] = value > 0.0 ? 1.0F : 0.0F;
      out[n + i] = static_cast<float>(logarithm);
    }
  }
}

/// Σ (a - b) ln(a/b) over a > 0 = Σ a ln a - a ln b - b ln a + [a > 0] b ln b, negated as above.
void divergence(MetricSide side, std::span<const double> row, std::span<float> out) noexcept {
  const std::size_t n = row.size();
  double own = 0.0;
  for (std::size_t i = 0; i < n; ++i) {
    const double value = std::max(row[i], 0.0);
    const double logarithm = value > 0.0 ? math::log(value) : 0.0;
    own += value * logarithm;
    if (side == MetricSide::Source) {
      out[i] = static_cast<float>(value);
      out[n + i] = static_cast<float>(logarithm);
      out[2 * n + i] = value > 0.0 ? -1.0F : 0.0F;
    } else {
      out[i] = value > 0.0 ? static_cast<float>(logarithm) : -kFar;
      out[n + i] = static_cast<float>(value);
      out[2 * n + i] = static_cast<float>(value * logarithm);
    }
  }
  out[3 * n] = side == MetricSide::Source ? static_cast<float>(-own) : 1.0F;
}

}  // namespace

MetricPlan plan_metric(Metric metric) noexcept {
  using kernels::RowScore;
  switch (metric) {
    case Metric::L2:
    case Metric::L2Squared:
    case Metric::Pf:
    case Metric::JeffriesMatusita:
      return {RowScore::SquaredDifference, 1, 0};
    case Metric::L1:
    case Metric::K:
      return {RowScore::Difference, 1, 0};
    case Metric::LInfinity:
      return {RowScore::LargestDifference, 1, 0};
    case Metric::Sublinear:
      return {RowScore::RootOfDifference, 1, 0};
    case Metric::ChiSquare:
      return {RowScore::ChiSquare, 1, 0};
    case Metric::Intersection:
      return {RowScore::Least, 1, 0};
    case Metric::Bhattacharyya:
    case Metric::Correlation:
      return {RowScore::Product, 1, 0};
    case Metric::KullbackLeibler:
      return {RowScore::Product, 2, 0};
    case Metric::Divergence:
      return {RowScore::Product, 3, 1};
  }
  return {};
}

void transform_row(Metric metric, const MetricFactors& factors, MetricSide side,
                   std::span<const double> row, std::span<float> out) noexcept {
  switch (metric) {
    case Metric::JeffriesMatusita:
    case Metric::Bhattacharyya:
      return rooted(row, out);
    case Metric::Pf:
    case Metric::K:
      return scaled(row, side == MetricSide::Source ? factors.source : factors.target, out);
    case Metric::Correlation:
      return standardised(row, out);
    case Metric::KullbackLeibler:
      return kullback_leibler(side, row, out);
    case Metric::Divergence:
      return divergence(side, row, out);
    default:
      return scaled(row, 1.0, out);
  }
}

}  // namespace grapnel
