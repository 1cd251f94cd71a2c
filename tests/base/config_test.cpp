#include "base/config.h"

#include <gtest/gtest.h>

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "base/file.h"
#include "tests/support/temp_folder.h"

namespace grapnel {
namespace {

enum class Color { Red, Green };
constexpr std::array<std::string_view, 2> kColors = {"red", "green"};

struct Params {
  double radius_m = 0.02;
  int count = 5;
  std::uint16_t small = 1;
  bool enabled = true;
  Color color = Color::Red;
  std::string name = "none";
  std::vector<double> plane;
  std::vector<std::string> tags;

  static FieldTable fields() {
    using P = Params;
    static constexpr std::array kFields = {
        number_field<&P::radius_m>("radius_m", "m", 0.001, 1.0, "radius"),
        number_field<&P::count>("count", "", 1, 100, "how many"),
        number_field<&P::small>("small", "", 0, 65535, "sixteen bits"),
        bool_field<&P::enabled>("enabled", "on or off"),
        choice_field<&P::color>("color", kColors, "of two"),
        text_field<&P::name>("name", "any text"),
        numbers_field<&P::plane>("plane", "m", -10.0, 10.0, "four numbers"),
        texts_field<&P::tags>("tags", "texts"),
    };
    return kFields;
  }
};

/// Reads as the daemon does: known fields, a sub-table, a list of tables, nothing else.
Params read(const std::string& text) {
  const ConfigTable table = parse_config(text, "p.toml");
  Params params;
  ConfigReader reader(table);
  reader.take_fields(Params::fields(), &params);
  if (const ConfigTable* below = reader.take_table("below")) {
    ConfigReader inner(*below);
    inner.take_number("depth_m", 0.0, 5.0, 1.0);
    inner.take_integer("index", 0, 9, 0);
    inner.take_bool("on", false);
    inner.take_text("label", "");
    inner.take_numbers("pose", 3);
    inner.take_texts("names");
    inner.finish();
  }
  for (const ConfigTable* item : reader.take_tables("item")) {
    ConfigReader inner(*item);
    inner.require("id");
    inner.take_integer("id", 1, 65535, 0);
    inner.finish();
  }
  reader.finish();
  return params;
}

std::string message_of(const std::string& text) {
  try {
    (void)read(text);
  } catch (const InputError& error) {
    return error.what();
  }
  return "accepted";
}

TEST(Config, FillsTheFieldsPresentAndKeepsTheRest) {
  const Params params = read(
      "radius_m = 0.5\nsmall = 65535\nenabled = false\ncolor = \"green\"\nname = \"a\"\n"
      "plane = [0, 0, 1.5, -2]\ntags = [\"x\", \"y\"]\n");
  EXPECT_EQ(params.radius_m, 0.5);
  EXPECT_EQ(params.count, 5);
  EXPECT_EQ(params.small, 65535);
  EXPECT_FALSE(params.enabled);
  EXPECT_EQ(params.color, Color::Green);
  EXPECT_EQ(params.name, "a");
  EXPECT_EQ(params.plane, (std::vector<double>{0, 0, 1.5, -2}));
  EXPECT_EQ(params.tags, (std::vector<std::string>{"x", "y"}));
}

TEST(Config, TakesAWholeNumberWhereARealOneBelongs) {
  EXPECT_EQ(read("radius_m = 1\n").radius_m, 1.0);
  EXPECT_EQ(read("count = 7.0\n").count, 7);
}

TEST(Config, TakesTheLimitsThemselves) {
  EXPECT_EQ(read("count = 1\n").count, 1);
  EXPECT_EQ(read("count = 100\n").count, 100);
}

struct Broken {
  const char* text;
  const char* place;    ///< how the message begins
  const char* mention;  ///< what else it says
};

constexpr auto kBroken = std::to_array<Broken>({

    {"radius = 1", "p.toml:1: radius: ", "did you mean \"radius_m\"?"},
    {"\n\ncuont = 3", "p.toml:3: cuont: ", "did you mean \"count\"?"},
    {"zzzzzz = 3", "p.toml:1: zzzzzz: ", "unknown key"},
    {"count = 0", "p.toml:1: count: 0 ", "1 to 100"},
    {"count = 101", "p.toml:1: count: 101 ", "1 to 100"},
    {"count = 2.5", "p.toml:1: count: 2.5 ", "a whole number"},
    {"count = \"3\"", "p.toml:1: count: \"3\" ", "a whole number"},
    {"count = [3]", "p.toml:1: count: ", "a whole number"},
    {"count = true", "p.toml:1: count: true ", "a whole number"},
    {"radius_m = 2", "p.toml:1: radius_m: 2 ", "0.001 to 1 m"},
    {"radius_m = -0.5", "p.toml:1: radius_m: -0.5 ", "0.001 to 1 m"},
    {"radius_m = nan", "p.toml:1: radius_m: nan ", "0.001 to 1 m"},
    {"radius_m = inf", "p.toml:1: radius_m: inf ", "0.001 to 1 m"},
    {"radius_m = \"wide\"", "p.toml:1: radius_m: \"wide\" ", "a number from"},
    {"enabled = 1", "p.toml:1: enabled: 1 ", "true or false"},
    {"enabled = \"yes\"", "p.toml:1: enabled: \"yes\" ", "true or false"},
    {"color = \"blue\"", "p.toml:1: color: \"blue\" ", "\"red\", \"green\""},
    {"color = 1", "p.toml:1: color: 1 ", "\"red\", \"green\""},
    {"name = 3", "p.toml:1: name: 3 ", "a text is"},
    {"plane = 3", "p.toml:1: plane: 3 ", "a list of numbers"},
    {"plane = [1, 11]", "p.toml:1: plane: 11 ", "-10 to 10 m"},
    {"plane = [1, \"x\"]", "p.toml:1: plane: \"x\" ", "-10 to 10 m"},
    {"tags = [\"a\", 3]", "p.toml:1: tags: 3 ", "texts"},
    {"count = 3\ncount = 4", "p.toml:2: ", "not valid TOML"},
    {"count = ", "p.toml:1: ", "not valid TOML"},
    {"name = \"open", "p.toml:1: ", "not valid TOML"},
    {"[below\ndepth_m = 1", "p.toml:1: ", "not valid TOML"},
    {"when = 2020-01-01", "p.toml:1: when: ", "dates and times"},
    {"below = 3", "p.toml:1: below: 3 ", "a table is"},
    {"[below]\ndepth_m = 9", "p.toml:2: below.depth_m: 9 ", "0 to 5"},
    {"[below]\nindex = 1.5", "p.toml:2: below.index: 1.5 ", "0 to 9"},
    {"[below]\nindex = 10", "p.toml:2: below.index: 10 ", "0 to 9"},
    {"[below]\non = 0", "p.toml:2: below.on: 0 ", "true or false"},
    {"[below]\nlabel = 0", "p.toml:2: below.label: 0 ", "a text is"},
    {"[below]\npose = [1, 2]", "p.toml:2: below.pose: ", "a list of 3 numbers"},
    {"[below]\nnames = \"a\"", "p.toml:2: below.names: ", "a list of texts"},
    {"[below]\ndeph_m = 1", "p.toml:2: below.deph_m: ", "did you mean \"depth_m\"?"},
    {"[[item]]\nid = 1\n[[item]]\nid = 0", "p.toml:4: item.id: 0 ", "1 to 65535"},
    {"[[item]]\n", "p.toml:1: item: ", "key \"id\" is missing"},
    {"\xff\xfe = 1", "p.toml:1: ", "not valid TOML"},
    {"name = \xc3\xa9", "p.toml:1: ", "not valid TOML"},
    {"[\n", "p.toml: ", "not valid TOML"},
    {"a = [[[[[[[[[[[[[[[[[[[[1]]]]]]]]]]]]]]]]]]]]", "p.toml:1: a: ", "nested deeper than 16"},
});

class BrokenConfig : public testing::TestWithParam<Broken> {};

TEST_P(BrokenConfig, IsRefusedWithPlaceKeyValueAndWhatIsAllowed) {
  const std::string message = message_of(GetParam().text);
  EXPECT_EQ(message.rfind(GetParam().place, 0), 0u) << message;
  EXPECT_NE(message.find(GetParam().mention), std::string::npos) << message;
  EXPECT_EQ(message.find('\n'), std::string::npos) << "one line";
}

INSTANTIATE_TEST_SUITE_P(Inputs, BrokenConfig, testing::ValuesIn(kBroken));

TEST(ConfigFile, SaysWhenItIsNotThereOrTooLarge) {
  const test::TempFolder folder;
  const auto message = [](const std::filesystem::path& file) {
    try {
      (void)load_config(file);
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string("accepted");
  };
  EXPECT_NE(message(folder / "absent.toml").find("absent.toml: can't be read: "),
            std::string::npos);
  write_file(folder / "huge.toml", std::string_view(std::string(kMaxConfigBytes + 1, ' ')));
  EXPECT_NE(message(folder / "huge.toml")
                .find("huge.toml: 1048577 bytes; a configuration file has at most 1048576"),
            std::string::npos);
  EXPECT_NE(message(folder.path()), "accepted");
}

TEST(ConfigFile, IsReadOrRefusedWhenCutAtAnyByte) {
  const std::string whole =
      "radius_m = 0.25\ncolor = \"green\"\n[below]\npose = [1, 2, 3]\n[[item]]\nid = 3\n";
  for (std::size_t size = 0; size < whole.size(); ++size) {
    EXPECT_NO_THROW((void)message_of(whole.substr(0, size))) << size;
  }
}

TEST(ConfigOverride, ReplacesAndAddsValuesInTheFilesOwnSyntax) {
  ConfigTable table = parse_config("count = 3\n[below]\nindex = 1\n", "p.toml");
  apply_override(table, "count=9");
  apply_override(table, "below.index=2");
  apply_override(table, "new.inner.key=word");
  apply_override(table, "list=[1, 2]");
  EXPECT_EQ(std::get<std::int64_t>(table.find("count")->data), 9);
  const auto& below = std::get<std::vector<ConfigTable>>(table.find("below")->data).front();
  EXPECT_EQ(std::get<std::int64_t>(below.find("index")->data), 2);
  const auto& fresh = std::get<std::vector<ConfigTable>>(table.find("new")->data).front();
  const auto& inner = std::get<std::vector<ConfigTable>>(fresh.find("inner")->data).front();
  EXPECT_EQ(std::get<std::string>(inner.find("key")->data), "word");
  EXPECT_EQ(std::get<std::vector<ConfigValue>>(table.find("list")->data).size(), 2u);
  EXPECT_THROW(apply_override(table, "count"), InputError);
  EXPECT_THROW(apply_override(table, "=3"), InputError);
}

TEST(ConfigOverride, ANumberIsAPlaceInAListOfTables) {
  ConfigTable table = parse_config("[[step]]\nindex = 1\n[[step]]\nindex = 2\n", "p.toml");
  apply_override(table, "step.index=7");
  apply_override(table, "step.2.index=8");
  apply_override(table, "step.3.index=9");
  EXPECT_THROW(apply_override(table, "step.5.index=1"), InputError);
  EXPECT_THROW(apply_override(table, "step.0.index=1"), InputError);
  ConfigReader reader(table);
  std::vector<std::int64_t> indices;
  for (const ConfigTable* step : reader.take_tables("step")) {
    indices.push_back(std::get<std::int64_t>(step->find("index")->data));
  }
  EXPECT_EQ(indices, (std::vector<std::int64_t>{7, 8, 9}));
}

TEST(ConfigOverride, AnotherMethodStartsItsTableAnew) {
  const std::string text = "[step]\nmethod = \"fine\"\nradius_m = 0.1\n";
  ConfigTable same = parse_config(text, "p.toml");
  apply_override(same, "step.method=fine");
  ConfigTable other = parse_config(text, "p.toml");
  apply_override(other, "step.count=3");
  apply_override(other, "step.method=coarse");
  const auto step = [](const ConfigTable& root) {
    return std::get<std::vector<ConfigTable>>(root.find("step")->data).front();
  };
  EXPECT_NE(step(same).find("radius_m"), nullptr);
  EXPECT_EQ(step(other).find("radius_m"), nullptr);
  EXPECT_NE(step(other).find("count"), nullptr);
  EXPECT_EQ(std::get<std::string>(step(other).find("method")->data), "coarse");
}

TEST(ConfigOverride, IsOneLine) {
  ConfigTable root = parse_config("", "f.toml");
  EXPECT_THROW(apply_override(root, "a = 1\nb = 2"), InputError);
  EXPECT_TRUE(root.entries().empty());
}

TEST(Config, AMessageIsOneLineWhateverTheKeysHold) {
  const ConfigTable root = parse_config("\"a\\nb\" = 1\n", "f.toml");
  ConfigReader reader(root);
  try {
    reader.finish();
    FAIL() << "an unknown key passed";
  } catch (const InputError& error) {
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
  }
}

TEST(ConfigOverride, IsNamedAsTheCommandLineWhenItIsWrong) {
  ConfigTable table = parse_config("count = 3\n", "p.toml");
  apply_override(table, "count=900");
  Params params;
  ConfigReader reader(table);
  try {
    reader.take_fields(Params::fields(), &params);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_STREQ(error.what(), "command line: count: 900 is out of range; 1 to 100 is allowed");
  }
}

TEST(NearestName, AllowsAThirdOfTheNameToDiffer) {
  const std::vector<std::string> known = {"radius_m", "count", "max_points"};
  EXPECT_EQ(nearest_name("raduis_m", known), "radius_m");
  EXPECT_EQ(nearest_name("maxpoints", known), "max_points");
  EXPECT_EQ(nearest_name("conut", known), "count");
  EXPECT_EQ(nearest_name("temperature", known), "");
}

TEST(FieldValueText, IsTheSyntaxThatIsReadBack) {
  Params params = read("radius_m = 0.125\ncolor = \"green\"\nplane = [1, -2.5]\n");
  std::string text;
  for (const Field& field : Params::fields()) {
    text += std::string(field.name) + " = " + field_value_text(field, &params) + "\n";
  }
  const Params again = read(text);
  EXPECT_EQ(again.radius_m, params.radius_m);
  EXPECT_EQ(again.color, params.color);
  EXPECT_EQ(again.plane, params.plane);
  EXPECT_EQ(again.enabled, params.enabled);
}

}  // namespace
}  // namespace grapnel
