#include "pipeline/correspond/metric.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>

#include "base/rng.h"

namespace grapnel {
namespace {

using Row = std::array<double, 3>;

double between(Metric metric, const Row& a, const Row& b, const MetricFactors& factors = {}) {
  return metric_distance(metric, a, b, factors);
}

TEST(Metric, GivesTheValuesWorkedByHand) {
  const Row a = {0.5, 0.5, 0.0};
  const Row b = {0.25, 0.25, 0.5};
  EXPECT_NEAR(between(Metric::L1, a, b), 1.0, 1e-15);
  EXPECT_NEAR(between(Metric::L2Squared, a, b), 0.375, 1e-15);
  EXPECT_NEAR(between(Metric::L2, a, b), std::sqrt(0.375), 1e-15);
  EXPECT_NEAR(between(Metric::LInfinity, a, b), 0.5, 1e-15);
  EXPECT_NEAR(between(Metric::JeffriesMatusita, a, b), std::sqrt(2.0 - std::sqrt(2.0)), 1e-15);
  EXPECT_NEAR(between(Metric::Bhattacharyya, a, b), 0.5 * std::log(2.0), 1e-15);
  EXPECT_NEAR(between(Metric::Sublinear, a, b), 1.0 + std::sqrt(0.5), 1e-15);
  EXPECT_NEAR(between(Metric::ChiSquare, a, b), 2.0 * 0.0625 / 0.75 + 0.5, 1e-15);
  EXPECT_NEAR(between(Metric::Divergence, a, b), 0.5 * std::log(2.0), 1e-15);
  EXPECT_NEAR(between(Metric::KullbackLeibler, a, b), std::log(2.0), 1e-15);
  EXPECT_NEAR(between(Metric::Intersection, a, b), 0.5, 1e-15);
  EXPECT_NEAR(between(Metric::Correlation, a, b), 2.0, 1e-15);
  EXPECT_NEAR(between(Metric::Pf, a, b, {1.0, 2.0}), 1.0, 1e-15);
  EXPECT_NEAR(between(Metric::K, a, b, {2.0, 4.0}), 2.0, 1e-15);
}

TEST(Metric, TreatsEmptyBinsAsPclDoes) {
  const Row a = {1.0, 0.0, 0.0};
  const Row b = {0.0, 1.0, 0.0};
  EXPECT_EQ(between(Metric::Divergence, a, b), std::numeric_limits<double>::infinity());
  EXPECT_EQ(between(Metric::KullbackLeibler, a, b), 0.0);
  EXPECT_EQ(between(Metric::ChiSquare, a, b), 2.0);
  EXPECT_EQ(between(Metric::Bhattacharyya, a, b), std::numeric_limits<double>::infinity());
}

TEST(Metric, IsSymmetricZeroForEqualRowsAndNeverNegativeOnDistributions) {
  Rng rng(5);
  const auto distribution = [&] {
    Row row{};
    double sum = 0.0;
    for (double& value : row) sum += value = rng.uniform(0.01, 1.0);
    for (double& value : row) value /= sum;
    return row;
  };
  for (int round = 0; round < 200; ++round) {
    const Row a = distribution();
    const Row b = distribution();
    for (std::size_t i = 0; i < kMetricNames.size(); ++i) {
      const auto metric = static_cast<Metric>(i);
      EXPECT_GE(between(metric, a, b), -1e-15) << kMetricNames[i];
      EXPECT_NEAR(between(metric, a, a), 0.0, 1e-12) << kMetricNames[i];
      if (metric == Metric::KullbackLeibler) continue;
      EXPECT_NEAR(between(metric, a, b), between(metric, b, a), 1e-12) << kMetricNames[i];
    }
    // Termwise bounds that make one metric a filter for the other.
    const double jm_squared = std::pow(between(Metric::JeffriesMatusita, a, b), 2.0);
    EXPECT_LE(jm_squared, between(Metric::ChiSquare, a, b) + 1e-12);
    EXPECT_GE(2.0 * jm_squared, between(Metric::ChiSquare, a, b) - 1e-12);
  }
}

}  // namespace
}  // namespace grapnel
