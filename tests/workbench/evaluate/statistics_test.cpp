#include "workbench/evaluate/statistics.h"

#include <gtest/gtest.h>

#include <cmath>

namespace grapnel {
namespace {

TEST(Quantile, InterpolatesBetweenOrderStatistics) {
  EXPECT_DOUBLE_EQ(quantile({4.0, 1.0, 3.0, 2.0}, 0.5), 2.5);
  EXPECT_DOUBLE_EQ(quantile({4.0, 1.0, 3.0, 2.0}, 0.9), 3.7);
  EXPECT_DOUBLE_EQ(quantile({7.0}, 0.99), 7.0);
}

TEST(Quantile, OfNothingIsNoNumber) { EXPECT_TRUE(std::isnan(quantile({}, 0.5))); }

// Agresti and Coull 1998 print 0.49 to 0.94 for 8 of 10.
TEST(Wilson, AgreesWithAPublishedInterval) {
  const Interval interval = wilson_95(8, 10);
  EXPECT_NEAR(interval.low, 0.4902, 1e-4);
  EXPECT_NEAR(interval.high, 0.9433, 1e-4);
}

TEST(UpperBound, OfNoHitsIsTheClosedForm) {
  EXPECT_NEAR(upper_bound_95(0, 30), 1.0 - std::pow(0.05, 1.0 / 30.0), 1e-9);
  EXPECT_NEAR(upper_bound_95(0, 10000), 3.0 / 10000.0, 1e-6);
}

// Solved with exact binomial sums in rational arithmetic.
TEST(UpperBound, OfSomeHitsSolvesTheBinomialTail) {
  EXPECT_NEAR(upper_bound_95(1, 20), 0.2161068, 1e-6);
  EXPECT_NEAR(upper_bound_95(3, 50), 0.1478372, 1e-6);
}

TEST(UpperBound, OfNoTrialsOrAllHitsIsOne) {
  EXPECT_EQ(upper_bound_95(0, 0), 1.0);
  EXPECT_EQ(upper_bound_95(5, 5), 1.0);
}

}  // namespace
}  // namespace grapnel
