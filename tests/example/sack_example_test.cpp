// Two views of a sack 20° apart, from keypoints to the merged cloud.
#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "tests/example/sack_steps.h"
#include "tests/example/sack_views.h"

namespace grapnel {
namespace {

using example::Outcome;
using example::SackPair;
using example::Steps;

const std::vector<SackPair>& pairs() {
  static const std::vector<SackPair> list = [] {
    std::vector<SackPair> made;
    for (std::uint64_t seed = 1; seed <= 3; ++seed) made.push_back(example::render_pair(seed));
    return made;
  }();
  return list;
}

TEST(SackExample, TheViewsAre20DegreesApartAndTheTruthBringsThemTogether) {
  for (const SackPair& pair : pairs()) {
    EXPECT_NEAR(rotation_angle_rad(pair.target_from_source, Pose::Identity()), 0.349066, 1e-6);
    const Surface& source = pair.source.surface->surface;
    const Surface& target = pair.target.surface->surface;
    EXPECT_GT(source.size, 10000U);
    EXPECT_GT(target.size, 10000U);
    Vec3d between = Vec3d::Zero();
    for (std::size_t i = 0; i < source.size; ++i) {
      between += pair.target_from_source * source.point(i).cast<double>() /
                 static_cast<double>(source.size);
    }
    for (std::size_t i = 0; i < target.size; ++i) {
      between -= target.point(i).cast<double>() / static_cast<double>(target.size);
    }
    // Each view sees more of its own side: at most the height of 0.18 m times the tangent of 20°.
    EXPECT_LT(between.norm(), 0.065);
  }
}

class EveryDetector : public testing::TestWithParam<const char*> {};

INSTANTIATE_TEST_SUITE_P(OfTheExample, EveryDetector, testing::ValuesIn(example::kDetectors),
                         [](const auto& given) { return std::string(given.param); });

TEST_P(EveryDetector, FindsPlacesAgainAndRejectionRaisesTheShareOfRightMatches) {
  double matched = 0.0;
  double matched_right = 0.0;
  double kept = 0.0;
  double kept_right = 0.0;
  for (const SackPair& pair : pairs()) {
    const Steps steps = example::take_steps(pair, GetParam(), "graph");
    const std::vector<bool> again = example::found_again(steps, pair);
    EXPECT_GT(std::count(again.begin(), again.end(), true), 0);
    const auto right = [&](const Correspondence& match) {
      return example::is_right(match, steps, pair);
    };
    matched += static_cast<double>(steps.matched.size());
    matched_right +=
        static_cast<double>(std::count_if(steps.matched.begin(), steps.matched.end(), right));
    kept += static_cast<double>(steps.kept.size());
    kept_right += static_cast<double>(std::count_if(steps.kept.begin(), steps.kept.end(), right));
  }
  ASSERT_GT(kept, 0.0);
  EXPECT_GT(kept_right / kept, matched_right / matched);
}

TEST(SackExample, NoCombinationHasAWrongPoseAccepted) {
  for (const example::Combination& combination : example::every_combination()) {
    const std::vector<Outcome> outcomes = example::register_pairs(combination, {pairs().data(), 1});
    const std::string what = combination.detector + " " + combination.rejector + " " +
                             combination.generator + " " + combination.refiner;
    for (const Outcome& outcome : outcomes) {
      EXPECT_TRUE(outcome.right() || !outcome.accepted) << what;
    }
  }
}

TEST(SackExample, TheCombinationThatWinsIsRightOnEveryPair) {
  example::Combination best;
  best.overrides = {"keypoints.method=principal_curvature"};
  for (const Outcome& outcome : example::register_pairs(best, pairs())) {
    EXPECT_TRUE(outcome.right());
  }
}

}  // namespace
}  // namespace grapnel
