// What every matcher of the registry must do under every metric.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <limits>
#include <vector>

#include "base/rng.h"
#include "pipeline/kernels/target.h"
#include "tests/contract/feature_contract.h"
#include "tests/support/heap_guard.h"

namespace grapnel {
namespace {

using test::MethodCase;

constexpr std::size_t kDimension = 33;
constexpr std::size_t kRows = 150;

/// Rows that sum to 1, all different.
struct Distributions {
  FeatureMatrix features;
  test::ArenaMemory memory{[this](Arena& arena) { features.reserve(arena, kRows, kDimension); }};
  explicit Distributions(std::uint64_t seed) {
    Rng rng(seed);
    features.rows = kRows;
    for (std::size_t i = 0; i < kRows; ++i) {
      double sum = 0.0;
      std::array<double, kDimension> row{};
      for (double& value : row) sum += value = rng.uniform(0.01, 1.0);
      for (std::size_t k = 0; k < kDimension; ++k) {
        features.row(i)[k] = static_cast<float>(row[k] / sum);
      }
    }
  }
};

class MatcherContract : public testing::TestWithParam<MethodCase> {
 protected:
  MatcherContract()
      : matcher_(test::make_stage(feature_matchers(), GetParam())),
        memory_([this](Arena& arena) { matcher_->reserve(arena, test::contract_limits()); }) {}

  std::unique_ptr<FeatureMatcher> matcher_;
  test::ArenaMemory memory_;
  std::vector<Correspondence> storage_ = std::vector<Correspondence>(kRows);
  Correspondences pairs_{storage_};
};

INSTANTIATE_TEST_SUITE_P(Registry, MatcherContract,
                         testing::ValuesIn(test::every_choice(feature_matchers(), "metric")),
                         [](const auto& given) { return test::case_name(given.param); });

TEST_P(MatcherContract, PairsEveryRowWithItselfInAShuffledCopy) {
  const Distributions source(1);
  const Distributions target(1);
  for (std::size_t i = 0; i < kRows; ++i) {
    std::ranges::copy(source.features.row(i), target.features.row((i * 7 + 3) % kRows).begin());
  }
  ASSERT_TRUE(matcher_->match(source.features, target.features, pairs_).ok());
  ASSERT_EQ(pairs_.size(), kRows);
  for (std::size_t i = 0; i < kRows; ++i) {
    EXPECT_EQ(pairs_[i].source, static_cast<std::int32_t>(i));
    EXPECT_EQ(pairs_[i].target, static_cast<std::int32_t>((i * 7 + 3) % kRows));
    EXPECT_NEAR(pairs_[i].distance, 0.0, 1e-6);
  }
}

TEST_P(MatcherContract, GivesTheSamePairsOnEveryTarget) {
  const Distributions source(2);
  const Distributions target(3);
  std::vector<Correspondence> first;
  for (const std::string& name : kernels::target_names()) {
    ASSERT_TRUE(kernels::force_target(name));
    const bool ok = matcher_->match(source.features, target.features, pairs_).ok();
    ASSERT_TRUE(kernels::force_target(""));
    ASSERT_TRUE(ok);
    if (first.empty()) first.assign(pairs_.begin(), pairs_.end());
    ASSERT_EQ(pairs_.size(), first.size());
    for (std::size_t i = 0; i < first.size(); ++i) {
      EXPECT_EQ(pairs_[i].target, first[i].target) << name;
      EXPECT_EQ(pairs_[i].distance, first[i].distance) << name;
    }
  }
}

TEST_P(MatcherContract, SurvivesRowsOfZerosNaNsAndInfinities) {
  const Distributions source(2);
  const Distributions target(3);
  const float odd[] = {0.0F, std::numeric_limits<float>::quiet_NaN(),
                       std::numeric_limits<float>::infinity(), -1.0F};
  for (std::size_t i = 0; i < 4; ++i) {
    std::ranges::fill(source.features.row(10 + i), odd[i]);
    std::ranges::fill(target.features.row(20 + i), odd[i]);
  }
  ASSERT_TRUE(matcher_->match(source.features, target.features, pairs_).ok());
  for (const Correspondence& pair : pairs_) {
    EXPECT_NE(pair.source, 10);
    EXPECT_NE(pair.target, 20);
    EXPECT_GE(pair.target, 0);
    EXPECT_LT(pair.target, static_cast<std::int32_t>(kRows));
  }
}

TEST_P(MatcherContract, GivesNothingForNothingAndRefusesMoreThanFits) {
  const Distributions source(2);
  Distributions target(3);
  target.features.rows = 0;
  ASSERT_TRUE(matcher_->match(source.features, target.features, pairs_).ok());
  EXPECT_TRUE(pairs_.empty());
  FeatureMatrix large;
  const test::ArenaMemory memory([&](Arena& arena) { large.reserve(arena, 500, kDimension); });
  large.rows = 500;
  const Status status = matcher_->match(source.features, large, pairs_);
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().code, Code::CapacityExceeded);
}

TEST_P(MatcherContract, DoesNotTouchTheHeap) {
  if (!test::heap_guard_works()) GTEST_SKIP() << test::kNoHeapGuard;
  const Distributions source(2);
  const Distributions target(3);
  test::arm_heap_guard();
  const bool ok = matcher_->match(source.features, target.features, pairs_).ok();
  test::disarm_heap_guard();
  EXPECT_TRUE(ok);
  EXPECT_EQ(test::heap_calls(), 0U) << test::first_heap_call();
}

}  // namespace
}  // namespace grapnel
