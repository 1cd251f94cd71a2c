#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "pipeline/preset.h"
#include "tests/support/temp_folder.h"
#include "tests/workbench/carton_set.h"
#include "tests/workbench/text_file.h"

namespace grapnel {
namespace {

using test::run_command;
using test::TempFolder;
using test::text_of;
using test::write_text;
using testing::HasSubstr;

TEST(TuneCommand, WritesThePresetThatFindsTheParts) {
  const TempFolder out;
  const std::string space = write_text(
      out / "space.toml", "base = \"object\"\n[keys]\n\"accept.min_fitness\" = [0.9, 0.9999]\n");
  const std::string suite = test::carton_set() / "set/suite.toml";
  const auto run =
      run_command({"tune", suite, "--space", space, "-o", out / "best.toml", "--jobs", "2"});
  ASSERT_EQ(run.code, 0) << run.error;
  EXPECT_THAT(run.out, HasSubstr("2 combinations and the base raced on 5 cases"));
  EXPECT_THAT(run.out, HasSubstr("wrong 0 of 5 cases"));
  const std::string text = text_of(out / "best.toml");
  EXPECT_THAT(text, HasSubstr("# Tuned from 01-object.toml on the suite \"carton-tune\", seed 1"));
  EXPECT_THAT(text, HasSubstr("accepted right 3 (found 3), wrong 0 of 5 cases"));
  EXPECT_EQ(text.find("0.9999"), std::string::npos) << "nothing matches so well";
  // It is a preset, and gives the same answers as what was raced.
  const Preset preset = load_preset((out / "best.toml"), out.path());
  EXPECT_EQ(preset.name, "best");
  const auto again = run_command(
      {"evaluate", suite, "--presets", out / "best.toml", "-o", out / "again", "--pictures", "0"});
  EXPECT_EQ(again.code, 0) << again.error;
  EXPECT_THAT(text_of(out / "again/summary.json"), HasSubstr("\"accepted_right\": 3"));
  // The same race a second time, in one job, ends the same way.
  ASSERT_EQ(run_command({"tune", suite, "--space", space, "-o", out / "twice.toml"}).code, 0);
  EXPECT_EQ(text_of(out / "twice.toml"), text);
}

TEST(TuneCommand, RefusesAnEmptySuite) {
  const TempFolder out;
  const std::string space = write_text(out / "space.toml", "[keys]\n\"search.kept\" = [12]\n");
  const std::string head = "[suite]\nname = \"s\"\ntolerance_m = 0.01\ntolerance_rad = 0.1\n";
  const std::string empty = write_text(out / "empty.toml", head);
  const auto none = run_command({"tune", empty, "--space", space, "-o", out / "best.toml"});
  EXPECT_EQ(none.code, 2);
  EXPECT_THAT(none.error, HasSubstr("case"));
  EXPECT_FALSE(std::filesystem::exists(out / "best.toml"));
  const auto nowhere = run_command({"tune", empty, "--space", space, "-o", out / "no/best.toml"});
  EXPECT_EQ(nowhere.code, 2);
  EXPECT_THAT(nowhere.error, HasSubstr("no folder"));
}

}  // namespace
}  // namespace grapnel
