// Writes docs/sack-example.md and its pictures: grapnel_sack_example [FOLDER, docs by default].
#include <algorithm>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>
#include <string>
#include <vector>

#include "tests/example/sack_pictures.h"

namespace grapnel::example {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kPairs = 10;

double median(std::vector<double> values) {
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

std::string number(double value, int digits) {
  char text[32];
  std::snprintf(text, sizeof text, "%.*f", digits, value);
  return text;
}

/// Sums over all pairs of what one detector's steps gave.
struct DetectorSums {
  double keypoints = 0.0;
  double again = 0.0;
  double matched = 0.0;
  double matched_right = 0.0;
  double kept = 0.0;
  double kept_right = 0.0;

  void add(const SackPair& pair, const Steps& steps) {
    const std::vector<bool> found = found_again(steps, pair);
    keypoints += static_cast<double>(found.size());
    again += static_cast<double>(std::count(found.begin(), found.end(), true));
    const auto right = [&](const Correspondence& match) { return is_right(match, steps, pair); };
    matched += static_cast<double>(steps.matched.size());
    matched_right +=
        static_cast<double>(std::count_if(steps.matched.begin(), steps.matched.end(), right));
    kept += static_cast<double>(steps.kept.size());
    kept_right += static_cast<double>(std::count_if(steps.kept.begin(), steps.kept.end(), right));
  }
};

std::string percent(double part, double whole) {
  return number(whole > 0.0 ? 100.0 * part / whole : 0.0, 0) + " %";
}

void write_keypoints(std::ostream& page, const std::vector<SackPair>& pairs) {
  page << "| detector | keypoints a view | found again in the other view | right matches of FPFH | "
          "right after rejection (`graph`) |\n|---|---|---|---|---|\n";
  for (const char* const detector : kDetectors) {
    DetectorSums sums;
    for (const SackPair& pair : pairs) sums.add(pair, take_steps(pair, detector, "graph"));
    const auto count = static_cast<double>(pairs.size());
    page << "| " << detector << " | " << number(sums.keypoints / count, 0) << " | "
         << percent(sums.again, sums.keypoints) << " | " << number(sums.matched_right / count, 0)
         << " of " << number(sums.matched / count, 0) << " ("
         << percent(sums.matched_right, sums.matched) << ") | "
         << number(sums.kept_right / count, 0) << " of " << number(sums.kept / count, 0) << " ("
         << percent(sums.kept_right, sums.kept) << ") |\n";
  }
}

struct Row {
  Combination combination;
  int right = 0;
  int accepted = 0;
  int wrongly_accepted = 0;
  double shift_mm = 0.0;
  double turn_deg = 0.0;
  double ms = 0.0;
};

Row row_of(const Combination& combination, const std::vector<SackPair>& pairs) {
  Row row;
  row.combination = combination;
  std::vector<double> shifts;
  std::vector<double> turns;
  std::vector<double> times;
  for (const Outcome& outcome : register_pairs(combination, pairs)) {
    times.push_back(outcome.ms);
    row.accepted += outcome.accepted ? 1 : 0;
    row.wrongly_accepted += outcome.accepted && !outcome.right() ? 1 : 0;
    if (!outcome.right()) continue;
    ++row.right;
    shifts.push_back(1e3 * outcome.error.shift_m);
    turns.push_back(outcome.error.turn_deg);
  }
  row.shift_mm = median(shifts);
  row.turn_deg = median(turns);
  row.ms = median(times);
  return row;
}

std::vector<Row> every_row(const std::vector<SackPair>& pairs) {
  std::vector<Row> rows;
  for (const Combination& combination : every_combination()) {
    rows.push_back(row_of(combination, pairs));
    std::fprintf(stderr, ".");
  }
  std::fprintf(stderr, "\n");
  std::stable_sort(rows.begin(), rows.end(), [](const Row& a, const Row& b) {
    return a.right != b.right ? a.right > b.right : a.shift_mm < b.shift_mm;
  });
  return rows;
}

void write_rows(std::ostream& page, const std::vector<Row>& rows) {
  page << "| keypoints | rejection | coarse | fine | right poses | accepted | wrongly accepted | "
          "median error | median ms |\n|---|---|---|---|---|---|---|---|---|\n";
  for (const Row& row : rows) {
    const Combination& c = row.combination;
    page << "| " << c.detector << " | " << c.rejector << " | " << c.generator << " | " << c.refiner
         << " | " << row.right << " | " << row.accepted << " | " << row.wrongly_accepted << " | "
         << number(row.shift_mm, 2) << " mm, " << number(row.turn_deg, 2) << "° | "
         << number(row.ms, 0) << " |\n";
  }
}

void save_pictures(const fs::path& folder, const SackPair& pair, const Combination& best) {
  fs::create_directories(folder);
  write_png(folder / "views.png", draw_views(pair));
  std::vector<RgbImage> keypoints;
  for (const char* const detector : kDetectors) {
    keypoints.push_back(draw_keypoints(pair, take_steps(pair, detector, "graph")));
  }
  write_png(folder / "keypoints.png", side_by_side(keypoints, 8));
  const Steps steps = take_steps(pair, best.detector, "graph");
  write_png(folder / "matched.png", draw_matches(pair, steps, steps.matched));
  write_png(folder / "kept.png", draw_matches(pair, steps, steps.kept));
  write_png(folder / "before.png", draw_merged(pair, Pose::Identity()));
  const std::vector<Outcome> outcome = register_pairs(best, {&pair, 1});
  write_png(folder / "merged.png", draw_merged(pair, outcome[0].target_from_source));
}

/// The page's text up to and after its tables, which stand between markers.
std::string between(const std::string& text, const std::string& name, const std::string& inner) {
  const std::string begin = "<!-- " + name + " -->\n";
  const std::string end = "<!-- end -->\n";
  const std::size_t from = text.find(begin);
  const std::size_t to = text.find(end, from);
  if (from == std::string::npos || to == std::string::npos) return text;
  return text.substr(0, from + begin.size()) + inner + text.substr(to);
}

void write_page(const fs::path& folder) {
  std::vector<SackPair> pairs;
  for (std::uint64_t seed = 1; seed <= kPairs; ++seed) pairs.push_back(render_pair(seed));
  std::ostringstream keypoints;
  write_keypoints(keypoints, pairs);
  const std::vector<Row> rows = every_row(pairs);
  std::ostringstream combinations;
  write_rows(combinations, rows);
  save_pictures(folder / "sack-example", pairs.front(), rows.front().combination);

  const fs::path file = folder / "sack-example.md";
  std::ifstream old(file);
  std::string text((std::istreambuf_iterator<char>(old)), std::istreambuf_iterator<char>());
  text = between(text, "keypoints", keypoints.str());
  text = between(text, "combinations", combinations.str());
  std::ofstream(file) << text;
}

}  // namespace
}  // namespace grapnel::example

int main(int count, char** arguments) {
  try {
    grapnel::example::write_page(count > 1 ? arguments[1] : GRAPNEL_SOURCE_DIR "/docs");
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
  return 0;
}
