#include "workbench/options.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "base/input_error.h"
#include "workbench/commands.h"

namespace grapnel {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

std::string message_of(Options& options, const std::vector<std::string>& args) {
  try {
    static_cast<void>(options.parse(args));
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

TEST(Options, FillsPositionalsValuesAndFlags) {
  std::string source;
  std::string preset = "pair";
  std::vector<std::string> sets;
  bool json = false;
  Options options("demo", "Shows.");
  options.positional("SOURCE", source, "moved");
  options.value("--preset", preset, "preset");
  options.repeated("--set", sets, "override");
  options.flag("--json", json, "JSON");
  const std::vector<std::string> args = {"--set", "a=1", "cloud.ply", "--set", "b=2", "--json"};
  ASSERT_TRUE(options.parse(args));
  EXPECT_EQ(source, "cloud.ply");
  EXPECT_EQ(preset, "pair");
  EXPECT_THAT(sets, ElementsAre("a=1", "b=2"));
  EXPECT_TRUE(json);
}

TEST(Options, NamesTheNearestKnownOption) {
  std::string source;
  std::string preset;
  Options options("demo", "Shows.");
  options.positional("SOURCE", source, "moved");
  options.value("--preset", preset, "preset");
  EXPECT_THAT(message_of(options, {"--presett", "x"}), HasSubstr("did you mean --preset?"));
}

TEST(Options, SaysWhichArgumentIsMissing) {
  std::string source;
  Options options("demo", "Shows.");
  options.positional("SOURCE", source, "moved");
  EXPECT_THAT(message_of(options, {}), HasSubstr("SOURCE"));
}

TEST(Options, RefusesANumberOutsideItsRange) {
  std::int64_t repeat = 1;
  Options options("demo", "Shows.");
  options.integer("--repeat", repeat, 1, 100, "times");
  EXPECT_THAT(message_of(options, {"--repeat", "101"}), HasSubstr("100"));
  EXPECT_THAT(message_of(options, {"--repeat", "1x"}), HasSubstr("1x"));
}

TEST(Options, TakesSeveralValuesAfterOneOption) {
  std::vector<std::string> presets;
  std::string folder;
  Options options("demo", "Shows.");
  options.list("--presets", presets, "presets");
  options.value("-o", folder, "folder");
  const std::vector<std::string> args = {"--presets", "a", "b,c", "-o", "out"};
  ASSERT_TRUE(options.parse(args));
  EXPECT_THAT(presets, ElementsAre("a", "b", "c"));
  EXPECT_EQ(folder, "out");
}

TEST(ParseIndices, ReadsSinglesAndRanges) {
  EXPECT_THAT(parse_indices("3,0-8:4,7", "--frames"), ElementsAre(3, 0, 4, 8, 7));
}

TEST(ParseIndices, RefusesWhatIsNoIndex) {
  EXPECT_THROW(static_cast<void>(parse_indices("1,,2", "--frames")), InputError);
  EXPECT_THROW(static_cast<void>(parse_indices("5-2", "--frames")), InputError);
  EXPECT_THROW(static_cast<void>(parse_indices("-1", "--frames")), InputError);
}

TEST(ParseNumbers, ChecksCountAndEachNumber) {
  EXPECT_THAT(parse_numbers("1,-2.5,3e-1", 3, "--roi"), ElementsAre(1.0, -2.5, 0.3));
  EXPECT_THROW(static_cast<void>(parse_numbers("1,2", 3, "--roi")), InputError);
  EXPECT_THROW(static_cast<void>(parse_numbers("1,nan,2", 3, "--roi")), InputError);
}

TEST(Grapnel, AnswersAnUnknownCommandWithExitCodeTwo) {
  const std::vector<std::string> args = {"no-such-command"};
  testing::internal::CaptureStderr();
  EXPECT_EQ(run_grapnel(args), 2);
  const std::string text = testing::internal::GetCapturedStderr();
  EXPECT_THAT(text, HasSubstr("unknown command \"no-such-command\""));
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 1);
}

}  // namespace
}  // namespace grapnel
