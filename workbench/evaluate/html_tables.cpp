#include "workbench/evaluate/html_tables.h"

#include <cmath>
#include <cstdio>

#include "base/code.h"
#include "base/math.h"

namespace grapnel {
namespace {

using Json = nlohmann::ordered_json;
using Row = std::vector<std::string>;

constexpr double kDegrees = 180.0 / math::kPi;

std::string count(const Json& value) { return html_number(value, 1.0, 0); }

/// "97.5 % of 40 (87.1 to 99.6)".
std::string rate(const Json& share, const Json& trials, const Json& interval) {
  if (!share.is_number()) return "–";
  return html_number(share, 100.0, 1) + " % of " + count(trials) + " (" +
         html_number(interval[0], 100.0, 1) + " to " + html_number(interval[1], 100.0, 1) + ")";
}

Row preset_row(const std::string& name, const Json& p) {
  Row row = {html_escaped(name)};
  for (const char* key : {"cases", "accepted_right", "accepted_wrong", "rejected_right",
                          "rejected_wrong", "errors", "raw_right"}) {
    row.push_back(count(p[key]));
  }
  row.push_back(rate(p["recall"], p["positives"], p["recall_95"]));
  row.push_back(html_number(p["false_accept_rate_upper_95"], 100.0, 3) + " % of " +
                count(p["cases"]));
  row.push_back(html_number(p["translation_m"]["median"], 1e3, 2) + " / " +
                html_number(p["translation_m"]["max"], 1e3, 2));
  row.push_back(html_number(p["rotation_rad"]["median"], kDegrees, 2) + " / " +
                html_number(p["rotation_rad"]["max"], kDegrees, 2));
  return row;
}

std::vector<Row> group_rows(const std::string& name, const Json& p) {
  std::vector<Row> rows;
  const Json& positive = p["positive_groups"];
  const double groups = positive.get<double>();
  const Json share =
      groups > 0.0 ? Json(p["positive_groups_all_right"].get<double>() / groups) : Json(nullptr);
  rows.push_back({html_escaped(name), "independent groups", count(p["independent_groups"]),
                  rate(share, positive, p["positive_groups_all_right_95"]),
                  count(p["false_accept_groups"]),
                  html_number(p["false_accept_group_rate_upper_95"], 100.0, 3)});
  for (const auto& [group, entry] : p["groups"].items()) {
    rows.push_back({html_escaped(name), html_escaped(group), count(entry["cases"]),
                    rate(entry["recall"], entry["positives"], entry["recall_95"]),
                    count(entry["accepted_wrong"]),
                    html_number(entry["false_accept_rate_upper_95"], 100.0, 3)});
  }
  return rows;
}

std::vector<Row> confusion_rows(const std::string& name, const Json& p) {
  std::vector<Row> rows;
  for (const Json& entry : p["confusion"]) {
    rows.push_back({html_escaped(name), entry["expect"].get<std::string>(),
                    entry["pose"].get<std::string>(), count(entry["cases"]),
                    count(entry["accepted"]), count(entry["rejected"]), count(entry["error"])});
  }
  return rows;
}

std::vector<Row> code_rows(const std::string& name, const Json& p) {
  std::vector<Row> rows;
  for (const auto& [code, cases] : p["codes"].items()) {
    const auto value = static_cast<Code>(std::stoul(code));
    rows.push_back({html_escaped(name), code,
                    std::string(value == Code::Ok ? "" : describe(value).text), cases.dump()});
  }
  return rows;
}

Row time_row(const std::string& name, const std::string& stage, const Json& times) {
  return {html_escaped(name), stage, html_number(times["p50"], 1.0, 2),
          html_number(times["p99"], 1.0, 2), html_number(times["max"], 1.0, 2)};
}

template <class Rows>
std::string section(const Json& summary, const std::string& heading, const Row& head, Rows rows) {
  std::vector<Row> all;
  for (const auto& [name, entry] : summary["presets"].items()) {
    for (Row& row : rows(name, entry)) all.push_back(std::move(row));
  }
  return "<h2>" + heading + "</h2>\n" + html_table(head, all);
}

std::vector<Row> time_rows(const std::string& name, const Json& p) {
  std::vector<Row> rows = {time_row(name, "frame or pair → verdict", p["total_ms"])};
  for (const auto& [stage, times] : p["stage_ms"].items()) {
    rows.push_back(time_row(name, stage, times));
  }
  return rows;
}

}  // namespace

std::string html_escaped(std::string_view text) {
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

std::string html_number(double value, int digits) {
  if (!std::isfinite(value)) return "–";
  char text[48];
  std::snprintf(text, sizeof text, "%.*f", digits, value);
  return text;
}

std::string html_number(const Json& value, double scale, int digits) {
  return value.is_number() ? html_number(value.get<double>() * scale, digits) : "–";
}

std::string html_table(const Row& head, const std::vector<Row>& rows) {
  std::string table = "<table><thead><tr>";
  for (const std::string& cell : head) table += "<th>" + cell;
  table += "</thead>\n";
  for (const Row& row : rows) {
    table += "<tr>";
    for (const std::string& cell : row) table += "<td>" + cell + "</td>";
    table += "</tr>\n";
  }
  return table + "</table>\n";
}

std::string html_summary(const Json& summary) {
  std::string page = section(
      summary, "Presets",
      {"preset", "cases", "accepted right", "false accepts", "rejected right", "missed", "errors",
       "right before the verdict", "positives accepted right (95 %)",
       "false accepts, upper 95 % bound", "displacement mm, median / max",
       "rotation °, median / max"},
      [](const std::string& name, const Json& p) { return std::vector<Row>{preset_row(name, p)}; });
  page += section(summary, "Groups: cases of one scene or recording count as one",
                  {"preset", "group", "n", "positives accepted right (95 %)", "false accepts",
                   "upper 95 % bound, %"},
                  group_rows);
  page += section(summary, "What the verdict made of the poses found",
                  {"preset", "expected", "pose", "cases", "accepted", "rejected", "error"},
                  confusion_rows);
  page += section(summary, "Codes", {"preset", "code", "meaning", "cases"}, code_rows);
  return page + section(summary, "Times, ms", {"preset", "stage", "p50", "p99", "max"}, time_rows);
}

}  // namespace grapnel
