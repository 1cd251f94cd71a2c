#include "workbench/tune/race.h"

#include <gtest/gtest.h>

#include <cstddef>
#include <set>
#include <vector>

namespace grapnel {
namespace {

CaseResult result_of(bool right, bool accepted, double error_m = 0.001) {
  CaseResult result;
  result.expect = Expect::Accept;
  result.right = right;
  result.answer.status = accepted ? Answer::Status::Accepted : Answer::Status::Rejected;
  PoseError error;
  error.mean_displacement_m = error_m;
  result.error = error;
  return result;
}

Tally tally_of(const std::vector<CaseResult>& results) {
  Tally tally;
  for (const CaseResult& result : results) tally.add(result);
  return tally;
}

TEST(Tally, CountsAWrongPoseAcceptedAndARightOneFound) {
  CaseResult negative = result_of(true, true);
  negative.expect = Expect::Reject;
  CaseResult error;
  error.answer.status = Answer::Status::Error;
  const Tally tally = tally_of({result_of(true, true, 0.003), result_of(true, false, 0.001),
                                result_of(false, true), negative, error});
  EXPECT_EQ(tally.cases, 5U);
  EXPECT_EQ(tally.accepted_right, 1U);
  EXPECT_EQ(tally.accepted_wrong, 2U);
  EXPECT_EQ(tally.found, 3U);
  EXPECT_EQ(tally.failed, 1U);
  EXPECT_EQ(tally.error_m.size(), 3U);
}

TEST(Tally, AWrongPoseOutweighsAnyNumberOfRightOnes) {
  const Tally careful = tally_of({result_of(true, false), result_of(true, false)});
  const Tally daring = tally_of({result_of(true, true), result_of(false, true)});
  EXPECT_TRUE(better(careful, daring));
  EXPECT_FALSE(better(daring, careful));
}

TEST(Tally, ThenCountsWhatIsAcceptedThenFoundThenNear) {
  const Tally accepts = tally_of({result_of(true, true), result_of(false, false)});
  const Tally finds = tally_of({result_of(true, false), result_of(true, false)});
  const Tally nearer = tally_of({result_of(true, true, 0.0005), result_of(false, false)});
  EXPECT_TRUE(better(accepts, finds));
  EXPECT_TRUE(better(nearer, accepts));
  EXPECT_FALSE(better(accepts, nearer));
  EXPECT_FALSE(better(accepts, accepts));
  EXPECT_FALSE(better(tally_of({result_of(false, false)}), tally_of({result_of(false, false)})));
}

/// Contestant k is right in the share k / (count - 1) of the cases; counts what runs.
struct Track {
  explicit Track(std::size_t contestants, std::size_t count) : cases(count), ran(contestants, 0) {
    for (std::size_t i = 0; i < count; ++i) cases[i].id = std::to_string(i);
  }
  std::vector<Standing> start() {
    return race(ran.size(), cases, Rng(3), [this](std::span<const Heat> heats) {
      std::vector<CaseResult> results;
      for (const Heat& heat : heats) {
        ++ran[heat.contestant];
        EXPECT_TRUE(seen.insert({heat.contestant, heat.case_i}).second) << "a case ran twice";
        const double share =
            static_cast<double>(heat.contestant) / static_cast<double>(ran.size() - 1);
        const bool right = static_cast<double>(heat.case_i % 16) < 16.0 * share;
        results.push_back(result_of(right, right));
      }
      return results;
    });
  }
  std::vector<SuiteCase> cases;
  std::vector<std::size_t> ran;
  std::set<std::pair<std::size_t, std::size_t>> seen;
};

TEST(Race, TheBestAndTheBaseRunOnEveryCaseAndTheWorstOnFew) {
  Track track(17, 160);
  const std::vector<Standing> left = track.start();
  ASSERT_FALSE(left.empty());
  EXPECT_EQ(left.front().contestant, 16U);
  EXPECT_EQ(left.front().tally.accepted_right, 160U);
  for (const Standing& standing : left) EXPECT_EQ(standing.tally.cases, 160U);
  // The base is right nowhere and stays for comparison.
  EXPECT_EQ(track.ran[0], 160U);
  EXPECT_EQ(left.back().contestant, 0U);
  EXPECT_EQ(track.ran[1], 20U);
  std::size_t all = 0;
  for (const std::size_t runs : track.ran) all += runs;
  EXPECT_LT(all, 17U * 160U / 2U);
}

TEST(Race, FewContestantsAndFewCasesAllRun) {
  Track track(3, 5);
  const std::vector<Standing> left = track.start();
  ASSERT_EQ(left.size(), 3U);
  for (const std::size_t runs : track.ran) EXPECT_EQ(runs, 5U);
}

TEST(Race, CasesOfOneGroupStayTogether) {
  std::vector<SuiteCase> cases(40);
  for (std::size_t i = 0; i < cases.size(); ++i) cases[i].group = "g" + std::to_string(i % 10);
  std::vector<std::size_t> first;
  const auto run = [&](std::span<const Heat> heats) {
    for (const Heat& heat : heats) {
      if (first.size() < 8 && heat.contestant == 0) first.push_back(heat.case_i);
    }
    return std::vector<CaseResult>(heats.size(), result_of(true, true));
  };
  static_cast<void>(race(12, cases, Rng(1), run));
  std::set<std::string> groups;
  for (const std::size_t i : first) groups.insert(cases[i].group);
  EXPECT_EQ(groups.size(), 2U);
}

}  // namespace
}  // namespace grapnel
