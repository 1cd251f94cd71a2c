#include "workbench/feature_csv.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "base/input_error.h"
#include "tests/support/temp_folder.h"
#include "tests/workbench/text_file.h"

namespace grapnel {
namespace {

using test::TempFolder;
using test::write_text;
using testing::ElementsAre;
using testing::HasSubstr;

template <class Load>
std::string message_of(Load load) {
  try {
    static_cast<void>(load());
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

TEST(FeatureCsv, ReadsIndexAndBins) {
  const TempFolder folder;
  const FeatureTable table =
      load_feature_csv(write_text(folder / "f.csv", "7,0.5,1e-3\r\n9,2,3\n"));
  EXPECT_THAT(table.index, ElementsAre(7, 9));
  EXPECT_EQ(table.dimension, 2U);
  EXPECT_THAT(table.bins, ElementsAre(0.5F, 1e-3F, 2.0F, 3.0F));
}

TEST(FeatureCsv, NamesTheLineThatIsWrong) {
  const TempFolder folder;
  const auto message = [&](const std::string& text) {
    return message_of([&] { return load_feature_csv(write_text(folder / "f.csv", text)); });
  };
  EXPECT_THAT(message("1,2,3\n4,5\n"), HasSubstr("f.csv:2"));
  EXPECT_THAT(message("1,nan\n"), HasSubstr("finite"));
  EXPECT_THAT(message("1.5,2\n"), HasSubstr("whole number"));
  EXPECT_THAT(message(""), HasSubstr("no row"));
}

TEST(CorrespondenceFile, ReadsJsonAndLines) {
  const TempFolder folder;
  const auto json = load_correspondences(write_text(
      folder / "a.json", R"({"correspondences": [{"source": 3, "target": 4, "distance": 0.25}]})"));
  const auto lines = load_correspondences(write_text(folder / "a.csv", "3,4,0.25\n"));
  for (const auto& pairs : {json, lines}) {
    ASSERT_EQ(pairs.size(), 1U);
    EXPECT_EQ(pairs[0].source, 3);
    EXPECT_EQ(pairs[0].target, 4);
    EXPECT_EQ(pairs[0].distance, 0.25F);
  }
}

TEST(CorrespondenceFile, RefusesWhatIsNoPair) {
  const TempFolder folder;
  EXPECT_THAT(message_of([&] { return load_correspondences(write_text(folder / "a.json", "{}")); }),
              HasSubstr("a.json"));
  EXPECT_THAT(message_of([&] {
                return load_correspondences(write_text(
                    folder / "b.json", R"({"correspondences": [{"source": -1, "target": 0}]})"));
              }),
              HasSubstr("whole number"));
  EXPECT_THAT(message_of([&] { return load_correspondences(write_text(folder / "c.csv", "1\n")); }),
              HasSubstr("c.csv:1"));
}

}  // namespace
}  // namespace grapnel
