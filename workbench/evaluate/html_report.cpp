#include "workbench/evaluate/html_report.h"

#include <algorithm>
#include <cmath>

#include "base/math.h"
#include "workbench/evaluate/html_tables.h"
#include "workbench/picture/scene_picture.h"

namespace grapnel {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kWorstCases = 50;
constexpr double kDegrees = 180.0 / math::kPi;
constexpr const char* kMarks[] = {"false accept", "error", "missed", ""};

std::string reasons_of(const CaseResult& result) {
  std::string text;
  for (const std::string& reason : result.answer.reasons) {
    text += (text.empty() ? "" : "; ") + html_escaped(reason);
  }
  return text;
}

std::string error_text(const CaseResult& result) {
  if (!result.error) return "no true pose";
  return html_number(result.error->mean_displacement_m * 1e3, 2) + " mm, " +
         html_number(result.error->rotation_rad * kDegrees, 2) + "°";
}

std::string swatch(const Rgb8& color, const char* meaning) {
  return "<span class=s style='background:rgb(" + std::to_string(color.r) + "," +
         std::to_string(color.g) + "," + std::to_string(color.b) + ")'></span>" + meaning + " ";
}

std::string legend() {
  return "<p>Left: depth. Middle: " + swatch(kFoundColor, "pose found") +
         swatch(kTruthColor, "true pose") +
         ". Right, by pixel of the pose found: " + swatch(kMatchedColor, "matched") +
         swatch(kContradictedColor, "contradicted (measured behind it)") +
         swatch(kOccludedColor, "occluded (measured before it)") +
         swatch(kUnknownColor, "unknown (no reading)") + "</p>\n";
}

std::string figure_of(const CaseResult& result, const RgbImage& image) {
  const int rank = rank_of(result);
  std::string caption = "<b>" + html_escaped(result.id) + "</b>, " + html_escaped(result.preset) +
                        ", expected: " + expect_name(result.expect) + ", " +
                        status_name(result.answer.status) + " " +
                        std::to_string(static_cast<unsigned>(result.answer.code));
  if (rank < 3) caption += ", <em>" + std::string(kMarks[rank]) + "</em>";
  caption += "; " + error_text(result);
  const std::string reasons = reasons_of(result);
  if (!reasons.empty()) caption += "<br>" + reasons;
  return "<figure class=r" + std::to_string(rank) + "><img alt='depth, pose, samples' src='" +
         "data:image/png;base64," + base64(png_of(image)) + "'><figcaption>" + caption +
         "</figcaption></figure>\n";
}

std::string row_of_case(const CaseResult& result) {
  const std::string rank = std::to_string(rank_of(result));
  std::string row = "<tr class=r" + rank + ">";
  for (const std::string& cell :
       {html_escaped(result.id), html_escaped(result.preset), std::string(kMarks[rank_of(result)]),
        std::string(status_name(result.answer.status)),
        std::to_string(static_cast<unsigned>(result.answer.code)), error_text(result),
        html_number(result.answer.report.fitness, 3), html_number(result.answer.report.margin, 3),
        html_number(result.answer.total_ms, 1), reasons_of(result)}) {
    row += "<td>" + cell + "</td>";
  }
  return row + "</tr>\n";
}

std::string worst_rows(const std::vector<CaseResult>& results) {
  std::vector<std::size_t> order = worst_first(results);
  order.resize(std::min(order.size(), kWorstCases));
  std::string rows;
  for (const std::size_t i : order) rows += row_of_case(results[i]);
  return rows;
}

constexpr const char* kHead = R"(<!doctype html>
<html lang=en><meta charset=utf-8><meta name=viewport content="width=device-width">
<style>
body{font:15px/1.5 system-ui,sans-serif;margin:2rem auto;max-width:80rem;padding:0 1rem;color:#1d2733}
table{border-collapse:collapse;width:100%;margin:.5rem 0 2rem}
th,td{border-bottom:1px solid #d5dbe2;padding:.3rem .6rem;text-align:left;vertical-align:top}
thead th{background:#eef1f5}
.r0 td,figure.r0{background:#fbe3e1}.r1 td,.r2 td,figure.r2{background:#fdf3dc}
figure{display:inline-block;width:42rem;max-width:100%;margin:.5rem;padding:.5rem;vertical-align:top}
figure img{max-width:100%}figcaption{font-size:13px}
.s{display:inline-block;width:.9em;height:.9em;margin:0 .3em -.1em .6em}
</style>
)";

}  // namespace

std::string html_report(const Json& summary, const std::vector<CaseResult>& results,
                        const std::vector<CasePicture>& pictures) {
  const std::string name = html_escaped(summary["suite"].get<std::string>());
  std::string page = kHead;
  page += "<title>" + name + "</title>\n<h1>" + name + "</h1>\n<p>A pose is right within " +
          html_number(summary["tolerance_m"], 1e3, 2) + " mm mean displacement and " +
          html_number(summary["tolerance_rad"], kDegrees, 2) + "° rotation. SIMD target " +
          html_escaped(summary["simd"].get<std::string>()) + ".</p>\n";
  page += html_summary(summary);
  if (!pictures.empty()) {
    page +=
        "<h2>Pictures</h2>\n<p>Every false accept first, then the worst of each outcome.</p>\n" +
        legend();
    for (const CasePicture& picture : pictures) {
      page += figure_of(results[picture.result_i], picture.image);
    }
  }
  page +=
      "<h2>Worst cases</h2>\n<table><thead><tr><th>case<th>preset<th><th>status<th>code<th>error"
      "<th>fitness<th>margin<th>ms<th>reasons</thead>\n" +
      worst_rows(results) + "</table>\n</html>\n";
  return page;
}

}  // namespace grapnel
