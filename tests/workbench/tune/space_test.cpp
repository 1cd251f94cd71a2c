#include "workbench/tune/space.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>
#include <string>

#include "base/input_error.h"
#include "pipeline/preset.h"
#include "tests/support/temp_folder.h"
#include "tests/workbench/text_file.h"
#include "workbench/presets.h"

namespace grapnel {
namespace {

using test::TempFolder;
using test::write_text;
using testing::HasSubstr;

Space space_of(const std::string& text) {
  const TempFolder folder;
  return load_space(write_text(folder / "space.toml", text));
}

std::string message_of(const std::string& text) {
  try {
    static_cast<void>(combinations(space_of(text), preset_file("object")));
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

TEST(Space, ReadsKeysWithDotsAndInTablesMethodsFirst) {
  const Space space = space_of(
      "base = \"pair\"\ndraws = 7\nseed = 5\n[keys]\n\"search.kept\" = [12, 24]\n"
      "general.measure_size = [true]\n[keys.descriptors]\nmethod = [\"fpfh\", \"pfh\"]\n");
  EXPECT_EQ(space.base, "pair");
  EXPECT_EQ(space.draws, 7U);
  EXPECT_EQ(space.seed, 5U);
  ASSERT_EQ(space.keys.size(), 3U);
  EXPECT_EQ(space.keys[0].key, "descriptors.method");
  EXPECT_EQ(space.keys[0].values, (std::vector<std::string>{"\"fpfh\"", "\"pfh\""}));
  EXPECT_EQ(space.keys[1].key, "search.kept");
  EXPECT_EQ(space.keys[1].values, (std::vector<std::string>{"12", "24"}));
}

TEST(Space, TriesEveryCombinationWhereThereAreFew) {
  const Space space = space_of(
      "[keys]\n\"search.kept\" = [12, 24, 48]\n\"descriptors.method\" = [\"fpfh\", \"pfh\"]\n");
  const std::vector<Combination> all = combinations(space, preset_file("object"));
  EXPECT_EQ(all.size(), 6U);
  EXPECT_EQ((std::set<Combination>(all.begin(), all.end()).size()), 6U);
  EXPECT_EQ(all[0], (Combination{"descriptors.method=\"fpfh\"", "search.kept=12"}));
}

TEST(Space, DrawsDifferentCombinationsWhereThereAreMany) {
  const std::string text =
      "draws = 20\n[keys]\n\"search.kept\" = [10, 20, 30, 40, 50]\n"
      "\"search.winners\" = [1, 2, 3, 4]\n\"search.finalists\" = [4, 6, 8, 10]\n";
  const std::vector<Combination> drawn = combinations(space_of(text), preset_file("object"));
  EXPECT_EQ(drawn.size(), 20U);
  EXPECT_EQ((std::set<Combination>(drawn.begin(), drawn.end()).size()), 20U);
  EXPECT_EQ(combinations(space_of(text), preset_file("object")), drawn);
  EXPECT_NE(combinations(space_of("seed = 2\n" + text), preset_file("object")), drawn);
}

TEST(Space, LeavesAKeyOutWhereAnotherMethodHasIt) {
  const std::vector<Combination> found =
      combinations(space_of("[keys]\n\"descriptors.method\" = [\"pfh\", \"spin_image\"]\n"
                            "\"descriptors.width\" = [6, 8]\n"),
                   preset_file("pair"));
  const std::vector<Combination> expected = {
      {"descriptors.method=\"pfh\""},
      {"descriptors.method=\"spin_image\"", "descriptors.width=6"},
      {"descriptors.method=\"spin_image\"", "descriptors.width=8"}};
  EXPECT_EQ(found, expected);
}

TEST(Space, NamesAValueThatIsNeverAllowed) {
  EXPECT_THAT(message_of("[keys]\n\"search.kept\" = [12, 0]\n"),
              testing::AllOf(HasSubstr("space.toml:2"), HasSubstr("search.kept = 0"),
                             HasSubstr("1 to 1024")));
  EXPECT_THAT(message_of("[keys]\n\"search.kepd\" = [12]\n"), HasSubstr("did you mean \"kept\""));
}

TEST(Space, NamesWhatIsMissingOrNoList) {
  EXPECT_THAT(message_of("draws = 3\n"), HasSubstr("keys"));
  EXPECT_THAT(message_of("[keys]\n\"search.kept\" = 12\n"), HasSubstr("a list of the values"));
  EXPECT_THAT(message_of("[keys]\n\"search.kept\" = []\n"), HasSubstr("a list of the values"));
  EXPECT_THAT(message_of("draws = 0\n[keys]\n\"search.kept\" = [12]\n"), HasSubstr("draws"));
}

}  // namespace
}  // namespace grapnel
