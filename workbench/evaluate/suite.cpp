#include "workbench/evaluate/suite.h"

#include <array>
#include <set>
#include <string_view>

#include "base/config.h"
#include "workbench/pose_text.h"

namespace grapnel {
namespace {

constexpr std::array<std::string_view, 3> kKinds = {"scene", "pair", "many"};
constexpr std::array<std::string_view, 3> kExpects = {"accept", "reject", "either"};

template <class Enum>
Enum take_choice(ConfigReader& reader, std::string_view key,
                 const std::array<std::string_view, 3>& names, std::string_view fallback) {
  const std::string text = reader.take_text(key, fallback);
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (text == names[i]) return static_cast<Enum>(i);
  }
  throw reader.problem(key, "\"" + text + "\" is not allowed; one of \"" + std::string(names[0]) +
                                "\", \"" + std::string(names[1]) + "\", \"" +
                                std::string(names[2]) + "\" is");
}

std::optional<Pose> take_pose(ConfigReader& reader, std::string_view key) {
  if (!reader.has(key)) return std::nullopt;
  const std::vector<double> numbers = reader.take_numbers(key, 16);
  const std::optional<Pose> pose = pose_from_numbers(numbers);
  if (!pose) {
    throw reader.problem(
        key, "not a rigid motion; a rotation, a translation and the last row 0 0 0 1 are allowed");
  }
  return pose;
}

std::string take_path(ConfigReader& reader, std::string_view key,
                      const std::filesystem::path& folder) {
  const std::string text = reader.take_text(key, "");
  return text.empty() ? text : (folder / text).lexically_normal().string();
}

std::optional<Symmetry> take_symmetry(ConfigReader& reader) {
  if (!reader.has("symmetry")) return std::nullopt;
  try {
    return symmetry_from_name(reader.take_text("symmetry", ""));
  } catch (const InputError& error) {
    throw reader.problem("symmetry", error.what());
  }
}

SuiteView read_view(const ConfigTable& table, const std::filesystem::path& folder) {
  ConfigReader reader(table);
  SuiteView view;
  reader.require("source");
  view.source = take_path(reader, "source", folder);
  view.camera = take_path(reader, "camera", folder);
  view.color = take_path(reader, "color", folder);
  view.mask = take_path(reader, "mask", folder);
  view.truth = take_pose(reader, "truth");
  reader.finish();
  return view;
}

/// True when the views have their truth.
bool read_views(ConfigReader& reader, const std::filesystem::path& folder, SuiteCase& one) {
  std::size_t truths = 0;
  for (const ConfigTable* table : reader.take_tables("view")) {
    one.views.push_back(read_view(*table, folder));
    truths += one.views.back().truth ? 1 : 0;
  }
  if (one.views.size() < 2) throw reader.problem("view", "two views or more are needed");
  if (truths != 0 && truths != one.views.size()) {
    throw reader.problem("view", "only some have a truth; all or none is allowed");
  }
  return truths > 0;
}

SuiteCase read_case(const ConfigTable& table, const std::filesystem::path& folder) {
  ConfigReader reader(table);
  SuiteCase one;
  reader.require("id");
  reader.require("kind");
  one.id = reader.take_text("id", "");
  if (one.id.empty()) throw reader.problem("id", "must not be empty");
  one.kind = take_choice<CaseKind>(reader, "kind", kKinds, "");
  bool views_with_truth = false;
  if (one.kind == CaseKind::Many) {
    views_with_truth = read_views(reader, folder, one);
  } else {
    reader.require("source");
    reader.require("target");
  }
  one.source = take_path(reader, "source", folder);
  one.target = take_path(reader, "target", folder);
  one.camera = take_path(reader, "camera", folder);
  one.color = take_path(reader, "color", folder);
  one.source_color = take_path(reader, "source_color", folder);
  one.truth = take_pose(reader, "truth");
  one.initial = take_pose(reader, "initial");
  one.symmetry = take_symmetry(reader);
  one.group = reader.take_text("group", "");
  const bool has_truth = one.truth || views_with_truth;
  one.expect = take_choice<Expect>(reader, "expect", kExpects, has_truth ? "accept" : "reject");
  if (one.expect != Expect::Reject && !has_truth) {
    throw reader.problem("expect", "\"" + std::string(expect_name(one.expect)) +
                                       "\" needs a truth; without one \"reject\" is allowed");
  }
  reader.finish();
  return one;
}

}  // namespace

const char* kind_name(CaseKind kind) noexcept {
  return kKinds[static_cast<std::size_t>(kind)].data();
}

const char* expect_name(Expect expect) noexcept {
  return kExpects[static_cast<std::size_t>(expect)].data();
}

Suite load_suite(const std::filesystem::path& file) {
  const ConfigTable root = load_config(file);
  const std::filesystem::path folder = std::filesystem::absolute(file).parent_path();
  ConfigReader reader(root);
  Suite suite;
  reader.require("suite");
  ConfigReader head(*reader.take_table("suite"));
  suite.name = head.take_text("name", file.stem().string());
  suite.tolerance_m = head.take_number("tolerance_m", 1e-9, 1e3, suite.tolerance_m);
  suite.tolerance_rad = head.take_number("tolerance_rad", 1e-9, 3.2, suite.tolerance_rad);
  head.finish();
  reader.require("case");
  std::set<std::string> ids;
  for (const ConfigTable* table : reader.take_tables("case")) {
    suite.cases.push_back(read_case(*table, folder));
    if (!ids.insert(suite.cases.back().id).second) {
      throw ConfigReader(*table).problem(
          "id", "\"" + suite.cases.back().id + "\" is the id of an earlier case; ids are unique");
    }
  }
  reader.finish();
  return suite;
}

}  // namespace grapnel
