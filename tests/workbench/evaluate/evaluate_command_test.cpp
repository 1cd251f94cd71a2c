// `grapnel evaluate` on a small simulated set, from the outside.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "tests/support/temp_folder.h"
#include "tests/workbench/carton_set.h"
#include "tests/workbench/text_file.h"

namespace grapnel {
namespace {

using test::run_command;
using test::TempFolder;
using test::text_of;
using testing::HasSubstr;

std::vector<nlohmann::json> lines_of(const std::filesystem::path& file) {
  std::vector<nlohmann::json> lines;
  std::istringstream text(text_of(file));
  for (std::string line; std::getline(text, line);) lines.push_back(nlohmann::json::parse(line));
  // What a run measures of itself differs from run to run.
  for (nlohmann::json& line : lines) {
    line.erase("stage_ms");
    line.erase("total_ms");
  }
  return lines;
}

TEST(EvaluateCommand, DrawsCasesIntoOnePageThatNeedsNothingElse) {
  const TempFolder out;
  const auto run = run_command({"evaluate", test::carton_set() / "set/suite.toml", "--presets",
                                "carton", "-o", out / "all", "--picture-files"});
  ASSERT_EQ(run.code, 0) << run.error;
  const std::string page = text_of(out / "all/report.html");
  EXPECT_THAT(page, HasSubstr("data:image/png;base64,"));
  EXPECT_THAT(page, HasSubstr("What the verdict made of the poses found"));
  EXPECT_EQ(page.find("http"), std::string::npos);
  std::size_t files = 0;
  for (const auto& file : std::filesystem::directory_iterator(out / "all/pictures")) {
    files += file.path().extension() == ".png" ? 1 : 0;
  }
  EXPECT_EQ(files, 5U);
}

TEST(EvaluateCommand, AnswersTheSameInOneJobInTwoAndInShards) {
  const TempFolder out;
  const std::string suite = test::carton_set() / "set/suite.toml";
  const auto results = [&](const std::string& name, std::vector<std::string> more) {
    std::vector<std::string> args = {"evaluate", suite,      "--presets",  "carton",
                                     "-o",       out / name, "--pictures", "0"};
    args.insert(args.end(), more.begin(), more.end());
    EXPECT_EQ(run_command(args).code, 0);
    return lines_of(out / name / "results.jsonl");
  };
  const std::vector<nlohmann::json> one = results("one", {"--jobs", "1"});
  ASSERT_EQ(one.size(), 5U);
  EXPECT_EQ(one, results("two", {"--jobs", "2"}));
  const std::vector<nlohmann::json> odd = results("odd", {"--shard", "1/2"});
  const std::vector<nlohmann::json> even = results("even", {"--shard", "2/2"});
  ASSERT_EQ(odd.size() + even.size(), 5U);
  for (std::size_t i = 0; i < one.size(); ++i) {
    EXPECT_EQ(one[i], i % 2 == 0 ? odd[i / 2] : even[i / 2]) << i;
  }
}

TEST(MergeCommand, MakesOfShardsTheSummaryOfTheWholeRun) {
  const TempFolder out;
  const std::string suite = test::carton_set() / "set/suite.toml";
  const auto evaluate = [&](const std::string& name, const std::string& shard) {
    EXPECT_EQ(run_command({"evaluate", suite, "--presets", "carton", "-o", out / name, "--pictures",
                           "0", "--shard", shard})
                  .code,
              0);
  };
  evaluate("all", "1/1");
  evaluate("odd", "1/2");
  evaluate("even", "2/2");
  const auto run = run_command({"merge", out / "odd", out / "even", "-o", out / "merged"});
  ASSERT_EQ(run.code, 0) << run.error;
  EXPECT_THAT(run.out, HasSubstr("5 cases"));
  const auto summary = [&](const std::string& name) {
    nlohmann::json json = nlohmann::json::parse(text_of(out / name / "summary.json"));
    for (auto& [preset, entry] : json["presets"].items()) {
      entry.erase("stage_ms");
      entry.erase("total_ms");
    }
    return json;
  };
  const auto nees_x = [](nlohmann::json& json) {
    const double mean = json["presets"]["carton"]["nees"]["x"].get<double>();
    json["presets"]["carton"].erase("nees");
    return mean;
  };
  nlohmann::json all = summary("all");
  nlohmann::json merged = summary("merged");
  // Sums of another order.
  EXPECT_NEAR(nees_x(merged), nees_x(all), 1e-9);
  EXPECT_EQ(merged, all);
  EXPECT_EQ(lines_of(out / "merged/results.jsonl").size(), 5U);
  EXPECT_THAT(text_of(out / "merged/report.html"), HasSubstr("carton"));
}

TEST(MergeCommand, CountsNoCaseTwice) {
  const TempFolder out;
  ASSERT_EQ(run_command({"evaluate", test::carton_set() / "set/suite.toml", "--presets", "carton",
                         "-o", out / "all", "--pictures", "0"})
                .code,
            0);
  const auto run = run_command({"merge", out / "all", out / "all", "-o", out / "merged"});
  EXPECT_EQ(run.code, 2);
  EXPECT_THAT(run.error, HasSubstr("was in an earlier folder with the same data"));
}

// The sixth negative of a set is the empty belt: no frame of a part to tell rounds apart by.
TEST(MergeCommand, TakesTheEmptyBeltsOfSeveralRounds) {
  const TempFolder out;
  for (const char* const seed : {"1", "2"}) {
    const std::string set = out / (std::string("set") + seed);
    ASSERT_EQ(run_command({"simulate", "--set-of", "carton", "--split", "tune", "--seed", seed,
                           "--positives", "1", "--either", "0", "--negatives", "6", "--instances",
                           "1", "-o", set})
                  .code,
              0);
    ASSERT_EQ(run_command({"evaluate", set + "/suite.toml", "--presets", "carton", "-o", out / seed,
                           "--pictures", "0"})
                  .code,
              0);
  }
  const auto run = run_command({"merge", out / "1", out / "2", "-o", out / "merged"});
  ASSERT_EQ(run.code, 0) << run.error;
  EXPECT_THAT(run.out, HasSubstr("14 cases"));
}

}  // namespace
}  // namespace grapnel
