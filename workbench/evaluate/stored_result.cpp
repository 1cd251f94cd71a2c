#include "workbench/evaluate/stored_result.h"

#include <array>
#include <limits>
#include <string_view>

#include "base/input_error.h"

namespace grapnel {
namespace {

using Json = nlohmann::json;

/// The value whose name `name_of` gives; `last` is the highest one.
template <class Enum, class NameOf>
Enum named(const Json& line, const char* key, Enum last, NameOf name_of) {
  const std::string text = line.at(key).get<std::string>();
  for (int i = 0; i <= static_cast<int>(last); ++i) {
    if (text == name_of(static_cast<Enum>(i))) return static_cast<Enum>(i);
  }
  throw InputError(std::string(key) + " \"" + text + "\" is none of a result's");
}

/// Numbers that are not finite are stored as null.
double number(const Json& value) {
  return value.is_null() ? std::numeric_limits<double>::quiet_NaN() : value.get<double>();
}

void read_answer(const Json& line, Answer& answer) {
  answer.status = named(line, "status", Answer::Status::Error, status_name);
  answer.code = static_cast<Code>(line.at("code").get<unsigned>());
  answer.reasons = line.at("reasons").get<std::vector<std::string>>();
  answer.seed = line.at("seed").get<std::uint32_t>();
  answer.total_ms = number(line.at("total_ms"));
  answer.peak_bytes = line.at("peak_bytes").get<std::size_t>();
  RegistrationReport& report = answer.report;
  report.code = answer.code;
  report.has_pose = line.contains("transform");
  report.fitness = number(line.at("fitness"));
  report.margin = number(line.at("margin"));
  for (auto i = static_cast<std::size_t>(Stage::Organize);
       i <= static_cast<std::size_t>(Stage::Judge); ++i) {
    const double ms = number(line.at("stage_ms").at(stage_name(static_cast<Stage>(i))));
    answer.stage_us[i] = static_cast<std::uint32_t>(ms * 1000.0 + 0.5);
  }
}

}  // namespace

CaseResult stored_result(const Json& line) {
  CaseResult result;
  result.id = line.at("id").get<std::string>();
  result.preset = line.at("preset").get<std::string>();
  result.kind = named(line, "kind", CaseKind::Many, kind_name);
  result.expect = named(line, "expect", Expect::Either, expect_name);
  result.group = line.value("group", "");
  result.right = line.at("right").get<bool>();
  if (!line.at("error_m").is_null()) {
    PoseError error;
    error.mean_displacement_m = line.at("error_m").get<double>();
    error.rotation_rad = line.at("error_rad").get<double>();
    result.error = error;
  }
  if (const auto found = line.find("nees"); found != line.end()) {
    std::array<double, 6> nees{};
    for (std::size_t i = 0; i < nees.size(); ++i) nees[i] = number(found->at(i));
    result.nees = nees;
  }
  read_answer(line, result.answer);
  return result;
}

}  // namespace grapnel
