#include "pipeline/correspond/nearest_feature.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>
#include <tuple>
#include <vector>

#include "base/rng.h"
#include "tests/pipeline/support/surfaces.h"

namespace grapnel {
namespace {

constexpr std::size_t kDimension = 33;

class NearestFeatureTest : public testing::Test {
 protected:
  NearestFeatureTest()
      : memory_([&](Arena& arena) {
          source_.reserve(arena, 60, kDimension);
          target_.reserve(arena, 80, kDimension);
        }),
        storage_(600),
        pairs_(storage_) {
    Rng rng(9);
    source_.rows = 60;
    target_.rows = 80;
    for (FeatureMatrix* features : {&source_, &target_}) {
      for (std::size_t i = 0; i < features->rows; ++i) {
        for (float& value : features->row(i)) value = static_cast<float>(rng.uniform(0.0, 100.0));
      }
    }
  }

  void match(const NearestFeatureParams& params) {
    Limits limits;
    limits.max_keypoints = 100;
    NearestFeature matcher(params);
    const test::ArenaMemory memory([&](Arena& arena) { matcher.reserve(arena, limits); });
    ASSERT_TRUE(matcher.match(source_, target_, pairs_).ok());
  }
  [[nodiscard]] double distance(std::size_t s, std::size_t t) const {
    double sum = 0.0;
    for (std::size_t i = 0; i < kDimension; ++i) {
      const double d =
          static_cast<double>(source_.row(s)[i]) - static_cast<double>(target_.row(t)[i]);
      sum += d * d;
    }
    return std::sqrt(sum);
  }
  [[nodiscard]] std::vector<std::size_t> by_distance(std::size_t s) const {
    std::vector<std::size_t> order(target_.rows);
    std::iota(order.begin(), order.end(), 0U);
    std::sort(order.begin(), order.end(),
              [&](std::size_t a, std::size_t b) { return distance(s, a) < distance(s, b); });
    return order;
  }

  FeatureMatrix source_;
  FeatureMatrix target_;
  test::ArenaMemory memory_;
  std::vector<Correspondence> storage_;
  Correspondences pairs_;
};

TEST_F(NearestFeatureTest, AgreesWithASortOfAllDistances) {
  NearestFeatureParams params;
  params.top = 3;
  match(params);
  ASSERT_EQ(pairs_.size(), 180U);
  for (std::size_t k = 0; k < pairs_.size(); ++k) {
    const std::size_t s = k / 3;
    const std::size_t t = by_distance(s)[k % 3];
    EXPECT_EQ(pairs_[k].source, static_cast<std::int32_t>(s));
    EXPECT_EQ(pairs_[k].target, static_cast<std::int32_t>(t));
    EXPECT_NEAR(static_cast<double>(pairs_[k].distance), distance(s, t), 1e-3);
  }
}

TEST_F(NearestFeatureTest, MutualPairsChooseEachOther) {
  NearestFeatureParams params;
  params.mutual = true;
  match(params);
  EXPECT_GT(pairs_.size(), 5U);
  EXPECT_LT(pairs_.size(), 60U);
  for (const Correspondence& pair : pairs_) {
    const auto t = static_cast<std::size_t>(pair.target);
    for (std::size_t s = 0; s < source_.rows; ++s) {
      EXPECT_GE(distance(s, t), distance(static_cast<std::size_t>(pair.source), t) - 1e-4);
    }
  }
}

TEST_F(NearestFeatureTest, TheRatioDropsPairsWithACloseSecond) {
  NearestFeatureParams params;
  params.max_ratio = 0.95;
  match(params);
  std::size_t expected = 0;
  for (std::size_t s = 0; s < source_.rows; ++s) {
    const std::vector<std::size_t> order = by_distance(s);
    if (distance(s, order[0]) <= 0.95 * distance(s, order[1])) ++expected;
  }
  EXPECT_EQ(pairs_.size(), expected);
}

TEST_F(NearestFeatureTest, RowsOfZerosMatchNothing) {
  std::ranges::fill(source_.row(7), 0.0F);
  std::ranges::fill(target_.row(11), 0.0F);
  match({});
  EXPECT_EQ(pairs_.size(), 59U);
  for (const Correspondence& pair : pairs_) {
    EXPECT_NE(pair.source, 7);
    EXPECT_NE(pair.target, 11);
  }
}

/// Every metric, with and without scaling of the rows.
class EveryMetric : public NearestFeatureTest,
                    public testing::WithParamInterface<std::tuple<std::size_t, Normalise>> {
 protected:
  [[nodiscard]] NearestFeatureParams params(Engine engine) const {
    NearestFeatureParams p;
    p.metric = static_cast<Metric>(std::get<0>(GetParam()));
    p.normalise = std::get<1>(GetParam());
    p.source_factor = 1.5;
    p.target_factor = 2.0;
    p.top = 2;
    p.engine = engine;
    return p;
  }
  [[nodiscard]] std::vector<double> distances(Engine engine, bool mutual) {
    NearestFeatureParams p = params(engine);
    p.mutual = mutual;
    match(p);
    std::vector<double> list;
    for (const Correspondence& pair : pairs_) list.push_back(static_cast<double>(pair.distance));
    return list;
  }
};

INSTANTIATE_TEST_SUITE_P(Metrics, EveryMetric,
                         testing::Combine(testing::Range<std::size_t>(0, kMetricNames.size()),
                                          testing::Values(Normalise::No, Normalise::Yes)),
                         [](const auto& given) {
                           return std::string(kMetricNames[std::get<0>(given.param)]) +
                                  (std::get<1>(given.param) == Normalise::Yes ? "_normalised" : "");
                         });

TEST_P(EveryMetric, FastFindsWhatPlainLoopsFind) {
  for (std::size_t i = 0; i < 60; i += 3) source_.row(i)[i % 33] = 0.0F;
  for (std::size_t i = 0; i < 80; i += 5) target_.row(i)[i % 33] = 0.0F;
  for (const bool mutual : {false, true}) {
    const std::vector<double> fast = distances(Engine::Fast, mutual);
    const std::vector<double> plain = distances(Engine::Reference, mutual);
    ASSERT_EQ(fast.size(), plain.size());
    EXPECT_GT(fast.size(), 2U);
    for (std::size_t i = 0; i < fast.size(); ++i) {
      // Sums of a hundred floats, some of them differences of products a thousand times larger.
      if (std::isinf(plain[i])) continue;
      EXPECT_NEAR(fast[i], plain[i], 1e-4 * (1.0 + std::fabs(plain[i])));
    }
  }
}

TEST_F(NearestFeatureTest, RowsOfAnotherLengthAndMoreThanReservedAreRefused) {
  FeatureMatrix other;
  const test::ArenaMemory other_memory([&](Arena& arena) { other.reserve(arena, 4, 20); });
  other.rows = 4;
  NearestFeature matcher({});
  Limits limits;
  limits.max_keypoints = 50;
  const test::ArenaMemory memory([&](Arena& arena) { matcher.reserve(arena, limits); });
  EXPECT_EQ(matcher.match(source_, other, pairs_).error().code, Code::BadParameter);
  EXPECT_EQ(matcher.match(source_, target_, pairs_).error().code, Code::CapacityExceeded);
}

TEST_F(NearestFeatureTest, NothingMatchesAnEmptyMatrix) {
  target_.rows = 0;
  match({});
  EXPECT_TRUE(pairs_.empty());
}

TEST_F(NearestFeatureTest, MoreThanFitIsMarked) {
  pairs_ = Correspondences(std::span(storage_).first(10));
  match({});
  EXPECT_EQ(pairs_.size(), 10U);
  EXPECT_TRUE(pairs_.overflowed());
}

}  // namespace
}  // namespace grapnel
