#include <algorithm>
#include <atomic>
#include <charconv>
#include <filesystem>
#include <iostream>
#include <numeric>
#include <string>
#include <string_view>
#include <system_error>
#include <thread>
#include <vector>

#include "base/file.h"
#include "base/input_error.h"
#include "workbench/commands.h"
#include "workbench/evaluate/case_pictures.h"
#include "workbench/evaluate/case_result.h"
#include "workbench/evaluate/html_report.h"
#include "workbench/evaluate/summary.h"
#include "workbench/options.h"
#include "workbench/presets.h"
#include "workbench/progress.h"

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

/// Registrars kept by a thread: cases come ordered by their model.
constexpr std::size_t kKeptRegistrars = 2;

/// Indices of all runs, those of one preset and source next to each other.
std::vector<std::size_t> order_of(const std::vector<SuiteCase>& cases, std::size_t presets) {
  std::vector<std::size_t> order(cases.size() * presets);
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    if (a % presets != b % presets) return a % presets < b % presets;
    return cases[a / presets].source < cases[b / presets].source;
  });
  return order;
}

std::vector<CaseResult> run_cases(const Suite& suite, const std::vector<SuiteCase>& cases,
                                  const std::vector<std::string>& presets, std::size_t jobs) {
  std::vector<CaseResult> results(cases.size() * presets.size());
  const std::vector<std::size_t> order = order_of(cases, presets.size());
  std::atomic<std::size_t> next{0};
  Progress progress("evaluate", results.size());
  const auto work = [&] {
    RegistrarStore store(kKeptRegistrars);
    for (std::size_t turn = next++; turn < order.size(); turn = next++) {
      const std::size_t i = order[turn];
      results[i] = run_case(suite, cases[i / presets.size()], presets[i % presets.size()], store);
      progress.step();
    }
  };
  std::vector<std::jthread> threads;
  for (std::size_t i = 1; i < jobs; ++i) threads.emplace_back(work);
  work();
  threads.clear();
  return results;
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
      run_cases(suite, cases, presets, static_cast<std::size_t>(jobs));
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
