#include "workbench/evaluate/summary.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "workbench/evaluate/html_report.h"

namespace grapnel {
namespace {

CaseResult result_of(Expect expect, Answer::Status status, bool right, const std::string& group) {
  CaseResult result;
  result.id = "id";
  result.preset = "default";
  result.group = group;
  result.expect = expect;
  result.answer.status = status;
  result.answer.code = status == Answer::Status::Accepted ? Code::ObjectFound : Code::BelowFitness;
  result.answer.total_ms = 10.0;
  result.right = right;
  if (expect != Expect::Reject) result.error = PoseError{right ? 0.001 : 0.5, 0.01};
  return result;
}

using enum Answer::Status;

/// 4 positives (right, wrong, missed, failed), 3 negatives (2 rejected, 1 accepted), 2 either.
std::vector<CaseResult> mixed_results() {
  return {result_of(Expect::Accept, Accepted, true, "a"),
          result_of(Expect::Accept, Accepted, false, "a"),
          result_of(Expect::Accept, Rejected, true, "b"),
          result_of(Expect::Accept, Error, false, "b"),
          result_of(Expect::Reject, Rejected, false, ""),
          result_of(Expect::Reject, Rejected, false, ""),
          result_of(Expect::Reject, Accepted, false, ""),
          result_of(Expect::Either, Accepted, true, "c"),
          result_of(Expect::Either, Rejected, false, "c")};
}

TEST(Summary, CountsEachCaseOnce) {
  const nlohmann::ordered_json json = summarise(mixed_results());
  EXPECT_EQ(json["cases"], 9);
  EXPECT_EQ(json["positives"], 4);
  EXPECT_EQ(json["negatives"], 3);
  EXPECT_EQ(json["accepted_right"], 2);
  EXPECT_EQ(json["accepted_wrong"], 2);
  EXPECT_EQ(json["rejected_right"], 3);
  EXPECT_EQ(json["rejected_wrong"], 2);
  EXPECT_EQ(json["errors"], 1);
  EXPECT_EQ(json["raw_right"], 3);
}

TEST(Summary, GivesRecallOfThePositivesAlone) {
  const nlohmann::ordered_json json = summarise(mixed_results());
  EXPECT_DOUBLE_EQ(json["recall"], 0.25);
  EXPECT_DOUBLE_EQ(json["false_accept_rate"], 2.0 / 9.0);
  EXPECT_GT(json["false_accept_rate_upper_95"], 2.0 / 9.0);
}

TEST(Summary, CountsAGroupWithFalseAcceptsOnce) {
  const nlohmann::ordered_json json = summarise(mixed_results());
  EXPECT_EQ(json["independent_groups"], 6);
  EXPECT_EQ(json["false_accept_groups"], 2);
  EXPECT_EQ(json["groups"]["a"]["accepted_wrong"], 1);
  EXPECT_DOUBLE_EQ(json["groups"]["a"]["recall"], 0.5);
}

TEST(Summary, AGroupIsASuccessWhenAllItsPositivesAreAcceptedRight) {
  std::vector<CaseResult> results = mixed_results();
  results.push_back(result_of(Expect::Accept, Accepted, true, "d"));
  results.push_back(result_of(Expect::Accept, Accepted, true, "d"));
  results.push_back(result_of(Expect::Accept, Accepted, true, ""));
  const nlohmann::ordered_json json = summarise(results);
  // a and b miss some, d does not, the case without group is its own; c has no positive.
  EXPECT_EQ(json["positive_groups"], 4);
  EXPECT_EQ(json["positive_groups_all_right"], 2);
}

TEST(Summary, TellsWhatTheVerdictMadeOfRightAndWrongPoses) {
  std::vector<CaseResult> results = mixed_results();
  for (CaseResult& result : results) result.answer.report.has_pose = true;
  results[5].answer.report.has_pose = false;
  const nlohmann::ordered_json rows = summarise(results)["confusion"];
  std::size_t cases = 0;
  for (const auto& row : rows) {
    cases += row["cases"].get<std::size_t>();
    EXPECT_EQ(row["cases"],
              row["accepted"].get<int>() + row["rejected"].get<int>() + row["error"].get<int>());
    if (row["expect"] == "accept" && row["pose"] == "wrong") {
      EXPECT_EQ(row["accepted"], 1);
      EXPECT_EQ(row["error"], 1);
    }
    if (row["expect"] == "reject" && row["pose"] == "none") {
      EXPECT_EQ(row["rejected"], 1);
    }
  }
  EXPECT_EQ(cases, results.size());
}

TEST(Summary, MeasuresErrorsOfAcceptedPosesOnly) {
  const nlohmann::ordered_json json = summarise(mixed_results());
  EXPECT_DOUBLE_EQ(json["translation_m"]["max"], 0.5);
  EXPECT_DOUBLE_EQ(json["translation_m"]["median"], 0.001);
  EXPECT_DOUBLE_EQ(json["total_ms"]["p99"], 10.0);
}

TEST(Summary, OfNegativesAloneHasNoRecall) {
  const std::vector<CaseResult> results = {result_of(Expect::Reject, Rejected, false, "")};
  const nlohmann::ordered_json json = summarise(results);
  EXPECT_TRUE(json["recall"].is_null());
  EXPECT_DOUBLE_EQ(json["false_accept_rate"], 0.0);
}

TEST(ResultLine, HasEveryFieldOfTheContract) {
  const nlohmann::ordered_json json = to_json(result_of(Expect::Accept, Accepted, true, "a"));
  for (const char* key :
       {"id", "preset", "status", "code", "reasons", "fitness", "rmse_m", "coverage",
        "free_space_violation", "margin", "sigma_m", "sigma_rad", "seed", "counts", "stage_ms",
        "total_ms", "error_m", "error_rad", "right"}) {
    EXPECT_TRUE(json.contains(key)) << key;
  }
  EXPECT_EQ(json["status"], "accepted");
  EXPECT_EQ(json["code"], 1100);
}

TEST(ResultLine, HasNoPoseOnError) {
  CaseResult result = result_of(Expect::Accept, Error, false, "a");
  result.answer.report.has_pose = true;
  EXPECT_FALSE(to_json(result).contains("transform"));
  result.answer.status = Rejected;
  EXPECT_TRUE(to_json(result).contains("transform"));
}

TEST(ResultLine, NamesTheRivalOfAnAmbiguousPose) {
  CaseResult result = result_of(Expect::Accept, Rejected, false, "a");
  result.answer.report.has_pose = true;
  EXPECT_FALSE(to_json(result).contains("rival"));
  result.answer.report.has_rival = true;
  result.answer.report.target_from_rival.translation() = Vec3d(0.1, 0.2, 0.3);
  EXPECT_EQ(to_json(result)["rival"][2][3], 0.3);
}

TEST(ResultLine, WritesNoNumberAsNull) {
  CaseResult result = result_of(Expect::Accept, Accepted, true, "a");
  result.answer.report.sigma_m = std::nan("");
  EXPECT_NE(to_json(result).dump().find("\"sigma_m\":null"), std::string::npos);
}

TEST(HtmlReport, ListsFalseAcceptsFirstAndEscapesNames) {
  Suite suite;
  suite.name = "<b>";
  std::vector<CaseResult> results = mixed_results();
  results[4].id = "negative-rejected";
  results[6].id = "negative-accepted";
  const std::string page = html_report(summary_of(suite, results), results, {});
  EXPECT_NE(page.find("&lt;b&gt;"), std::string::npos);
  EXPECT_LT(page.find("negative-accepted"), page.find("negative-rejected"));
  EXPECT_EQ(page.find("http"), std::string::npos);
}

TEST(HtmlReport, HoldsItsPicturesItself) {
  Suite suite;
  suite.name = "one";
  const std::vector<CaseResult> results = {result_of(Expect::Accept, Accepted, false, "")};
  const std::vector<CasePicture> pictures = {{0, RgbImage(4, 3, {10, 20, 30})}};
  const std::string page = html_report(summary_of(suite, results), results, pictures);
  // Every PNG begins with these bytes.
  EXPECT_NE(page.find("src='data:image/png;base64,iVBORw0KGgo"), std::string::npos);
  EXPECT_NE(page.find("false accept"), std::string::npos);
}

TEST(WorstFirst, PutsFalseAcceptsBeforeMissesBeforeLargeErrors) {
  const std::vector<CaseResult> results = {result_of(Expect::Accept, Accepted, true, ""),
                                           result_of(Expect::Accept, Rejected, false, ""),
                                           result_of(Expect::Reject, Accepted, false, ""),
                                           result_of(Expect::Either, Rejected, false, "")};
  EXPECT_EQ(worst_first(results), (std::vector<std::size_t>{2, 1, 3, 0}));
}

}  // namespace
}  // namespace grapnel
