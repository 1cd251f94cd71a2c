#include <algorithm>
#include <charconv>
#include <filesystem>
#include <iostream>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include "base/file.h"
#include "base/input_error.h"
#include "workbench/commands.h"
#include "workbench/evaluate/case_pictures.h"
#include "workbench/evaluate/case_result.h"
#include "workbench/evaluate/html_report.h"
#include "workbench/evaluate/run_cases.h"
#include "workbench/evaluate/summary.h"
#include "workbench/options.h"
#include "workbench/presets.h"

namespace grapnel {
namespace {

namespace fs = std::filesystem;

struct Shard {
  std::size_t index = 1;  ///< 1…count
  std::size_t count = 1;
};

Shard parse_shard(const std::string& text) {
  Shard shard;
  if (text.empty()) return shard;
  const char* end = text.data() + text.size();
  const auto first = std::from_chars(text.data(), end, shard.index);
  const bool slash = first.ec == std::errc() && first.ptr != end && *first.ptr == '/';
  const auto second = slash ? std::from_chars(first.ptr + 1, end, shard.count) : first;
  if (!slash || second.ec != std::errc() || second.ptr != end || shard.index < 1 ||
      shard.index > shard.count) {
    throw InputError("--shard " + text + ": I/N with I from 1 to N is allowed");
  }
  return shard;
}

/// Every case by every preset.
std::vector<CaseRun> runs_of(const std::vector<SuiteCase>& cases,
                             const std::vector<std::string>& presets) {
  std::vector<CaseRun> runs;
  for (const SuiteCase& one : cases) {
    for (const std::string& preset : presets) runs.push_back({&one, preset, {}});
  }
  return runs;
}

std::vector<CasePicture> draw(const std::vector<SuiteCase>& cases, std::size_t presets,
                              const std::vector<CaseResult>& results, std::size_t count,
                              int panel_px) {
  std::vector<const SuiteCase*> case_of;
  for (std::size_t i = 0; i < results.size(); ++i) case_of.push_back(&cases[i / presets]);
  return draw_cases(results, case_of, count, panel_px);
}

/// Names are the cases' own, with nothing in them that a file system takes amiss.
void write_pictures(const fs::path& folder, const std::vector<CaseResult>& results,
                    const std::vector<CasePicture>& pictures) {
  std::error_code code;
  fs::create_directories(folder, code);
  if (code) throw InputError(folder.string() + ": can't be made: " + code.message());
  for (const CasePicture& picture : pictures) {
    std::string name = results[picture.result_i].preset + "-" + results[picture.result_i].id;
    std::replace_if(
        name.begin(), name.end(),
        [](char c) { return std::string_view("/\\:*?\"<>| ").find(c) != std::string_view::npos; },
        '_');
    write_png(folder / (name + ".png"), picture.image);
  }
}

}  // namespace

int run_evaluate(std::span<const std::string> args) {
  std::string file;
  std::string folder;
  std::string shard_text;
  std::vector<std::string> presets;
  std::int64_t jobs = 1;
  std::int64_t pictures = 24;
  std::int64_t panel_px = 220;
  bool as_files = false;
  Options options("evaluate", "Runs presets over a suite of cases with known truth.");
  options.positional("SUITE.toml", file, "the suite");
  options.list("--presets", presets,
               "names, numbers or files; without it the general one of each case's kind");
  options.required("-o,--output", folder, "folder for results.jsonl, summary.json, report.html");
  options.integer("--jobs", jobs, 1, 256, "cases run at once; results do not depend on it");
  options.integer("--pictures", pictures, 0, 1000, "cases drawn in report.html");
  options.integer("--panel-px", panel_px, 32, 2000, "longer side of a picture's panels");
  options.flag("--picture-files", as_files, "also write each picture to DIR/pictures/CASE.png");
  options.value("--shard", shard_text, "I/N: only every N-th case, beginning with the I-th");
  if (!options.parse(args)) return 0;

  const Suite suite = load_suite(file);
  const Shard shard = parse_shard(shard_text);
  for (const std::string& preset : presets) static_cast<void>(preset_file(preset));
  if (presets.empty()) presets = {"default"};
  std::vector<SuiteCase> cases;
  for (std::size_t i = shard.index - 1; i < suite.cases.size(); i += shard.count) {
    cases.push_back(suite.cases[i]);
  }
  std::error_code code;
  fs::create_directories(folder, code);
  if (code) throw InputError(folder + ": can't be made: " + code.message());

  const std::vector<CaseResult> results =
      run_cases(suite, runs_of(cases, presets), static_cast<std::size_t>(jobs), "evaluate");
  std::string lines;
  for (const CaseResult& result : results) lines += to_json(result).dump() + "\n";
  const nlohmann::ordered_json summary = summary_of(suite, results);
  write_file(fs::path(folder) / "results.jsonl", std::string_view(lines));
  write_file(fs::path(folder) / "summary.json", std::string_view(summary.dump(2) + "\n"));
  const std::vector<CasePicture> drawn =
      draw(cases, presets.size(), results, static_cast<std::size_t>(pictures),
           static_cast<int>(panel_px));
  if (as_files) write_pictures(fs::path(folder) / "pictures", results, drawn);
  write_file(fs::path(folder) / "report.html",
             std::string_view(html_report(summary, results, drawn)));
  print_summary(summary);
  return 0;
}

}  // namespace grapnel
