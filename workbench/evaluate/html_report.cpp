#include "workbench/evaluate/html_report.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <vector>

#include "base/code.h"
#include "base/math.h"

namespace grapnel {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kWorstCases = 50;

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      default:
        out += c;
    }
  }
  return out;
}

std::string number(double value, int digits) {
  if (!std::isfinite(value)) return "–";
  char text[48];
  std::snprintf(text, sizeof text, "%.*f", digits, value);
  return text;
}

std::string number(const Json& value, double scale, int digits) {
  return value.is_number() ? number(value.get<double>() * scale, digits) : "–";
}

std::string cell(const std::string& text) { return "<td>" + text + "</td>"; }

std::string row_of_preset(const std::string& name, const Json& p) {
  constexpr double kDegrees = 180.0 / math::kPi;
  std::string row = "<tr><th scope=row>" + escaped(name) + "</th>";
  for (const char* key : {"cases", "accepted_right", "accepted_wrong", "rejected_right",
                          "rejected_wrong", "errors", "raw_right"}) {
    row += cell(number(p[key], 1.0, 0));
  }
  row += cell(number(p["recall"], 100.0, 1));
  row += cell(number(p["false_accept_rate_upper_95"], 100.0, 2));
  row += cell(number(p["translation_m"]["median"], 1e3, 2) + " / " +
              number(p["translation_m"]["max"], 1e3, 2));
  row += cell(number(p["rotation_rad"]["median"], kDegrees, 2) + " / " +
              number(p["rotation_rad"]["max"], kDegrees, 2));
  row += cell(number(p["total_ms"]["p50"], 1.0, 1) + " / " + number(p["total_ms"]["p99"], 1.0, 1));
  return row + "</tr>\n";
}

std::string code_rows(const std::string& name, const Json& p) {
  std::string rows;
  for (const auto& [code, count] : p["codes"].items()) {
    const auto value = static_cast<Code>(std::stoul(code));
    rows += "<tr>" + cell(escaped(name)) + cell(code) +
            cell(std::string(value == Code::Ok ? "" : describe(value).text)) + cell(count.dump()) +
            "</tr>\n";
  }
  return rows;
}

/// Smaller is worse.
int rank(const CaseResult& result) {
  if (result.false_accept()) return 0;
  if (result.failed()) return 1;
  if (result.expect == Expect::Accept && !result.accepted()) return 2;
  return 3;
}

double error_m(const CaseResult& result) {
  return result.error ? result.error->mean_displacement_m : 0.0;
}

std::string row_of_case(const CaseResult& result) {
  constexpr double kDegrees = 180.0 / math::kPi;
  static constexpr const char* kMarks[] = {"false accept", "error", "missed", ""};
  std::string reasons;
  for (const std::string& reason : result.answer.reasons) {
    reasons += (reasons.empty() ? "" : "; ") + reason;
  }
  const std::string error_mm = result.error ? number(error_m(result) * 1e3, 2) : "–";
  const std::string error_deg =
      result.error ? number(result.error->rotation_rad * kDegrees, 2) : "–";
  return "<tr class=r" + std::to_string(rank(result)) + ">" + cell(escaped(result.id)) +
         cell(escaped(result.preset)) + cell(kMarks[rank(result)]) +
         cell(status_name(result.answer.status)) +
         cell(std::to_string(static_cast<unsigned>(result.answer.code))) + cell(error_mm) +
         cell(error_deg) + cell(number(result.answer.report.fitness, 3)) +
         cell(number(result.answer.report.margin, 3)) + cell(number(result.answer.total_ms, 1)) +
         cell(escaped(reasons)) + "</tr>\n";
}

std::string worst_rows(std::span<const CaseResult> results) {
  std::vector<const CaseResult*> order;
  for (const CaseResult& result : results) order.push_back(&result);
  std::stable_sort(order.begin(), order.end(), [](const CaseResult* a, const CaseResult* b) {
    if (rank(*a) != rank(*b)) return rank(*a) < rank(*b);
    return error_m(*a) > error_m(*b);
  });
  order.resize(std::min(order.size(), kWorstCases));
  std::string rows;
  for (const CaseResult* result : order) rows += row_of_case(*result);
  return rows;
}

constexpr const char* kHead = R"(<!doctype html>
<html lang=en><meta charset=utf-8><meta name=viewport content="width=device-width">
<style>
body{font:15px/1.5 system-ui,sans-serif;margin:2rem auto;max-width:80rem;padding:0 1rem;color:#1d2733}
table{border-collapse:collapse;width:100%;margin:.5rem 0 2rem}
th,td{border-bottom:1px solid #d5dbe2;padding:.3rem .6rem;text-align:left;vertical-align:top}
thead th{background:#eef1f5}
.r0 td{background:#fbe3e1}.r1 td,.r2 td{background:#fdf3dc}
</style>
)";

}  // namespace

std::string html_report(const Json& summary, std::span<const CaseResult> results) {
  const std::string name = escaped(summary["suite"].get<std::string>());
  std::string presets;
  std::string codes;
  for (const auto& [preset, entry] : summary["presets"].items()) {
    presets += row_of_preset(preset, entry);
    codes += code_rows(preset, entry);
  }
  std::string page = kHead;
  page += "<title>" + name + "</title>\n<h1>" + name + "</h1>\n<p>A pose is right within " +
          number(summary["tolerance_m"], 1e3, 2) + " mm mean displacement and " +
          number(summary["tolerance_rad"], 180.0 / math::kPi, 2) + "° rotation. SIMD target " +
          escaped(summary["simd"].get<std::string>()) + ".</p>\n";
  page +=
      "<h2>Presets</h2>\n<table><thead><tr><th>preset<th>cases<th>accepted right<th>false "
      "accepts<th>rejected right<th>missed<th>errors<th>right before the verdict<th>recall "
      "%<th>false accept rate, upper 95 % bound, %<th>displacement mm, median / max<th>rotation °, "
      "median / max<th>time ms, p50 / p99</thead>\n" +
      presets + "</table>\n";
  page += "<h2>Codes</h2>\n<table><thead><tr><th>preset<th>code<th>meaning<th>cases</thead>\n" +
          codes + "</table>\n";
  page +=
      "<h2>Worst cases</h2>\n<table><thead><tr><th>case<th>preset<th><th>status<th>code<th>error "
      "mm<th>error °<th>fitness<th>margin<th>ms<th>reasons</thead>\n" +
      worst_rows(results) + "</table>\n</html>\n";
  return page;
}

}  // namespace grapnel
