#include <atomic>
#include <charconv>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <string>
#include <system_error>
#include <thread>
#include <vector>

#include "base/input_error.h"
#include "workbench/commands.h"
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

std::vector<CaseResult> run_cases(const Suite& suite, const std::vector<SuiteCase>& cases,
                                  const std::vector<std::string>& presets, std::size_t jobs) {
  std::vector<CaseResult> results(cases.size() * presets.size());
  std::atomic<std::size_t> next{0};
  Progress progress("evaluate", results.size());
  const auto work = [&] {
    for (std::size_t i = next++; i < results.size(); i = next++) {
      results[i] = run_case(suite, cases[i / presets.size()], presets[i % presets.size()]);
      progress.step();
    }
  };
  std::vector<std::jthread> threads;
  for (std::size_t i = 1; i < jobs; ++i) threads.emplace_back(work);
  work();
  threads.clear();
  return results;
}

void write_file(const fs::path& file, const std::string& text) {
  std::ofstream stream(file, std::ios::binary);
  stream << text;
  stream.flush();
  if (!stream) throw InputError(file.string() + ": can't be written");
}

void print_summary(const nlohmann::ordered_json& summary) {
  for (const auto& [name, p] : summary["presets"].items()) {
    std::cout << name << ": " << p["cases"] << " cases, accepted right " << p["accepted_right"]
              << ", false accepts " << p["accepted_wrong"] << ", rejected right "
              << p["rejected_right"] << ", missed " << p["rejected_wrong"] << ", errors "
              << p["errors"] << ", right before the verdict " << p["raw_right"] << "\n";
  }
}

}  // namespace

int run_evaluate(std::span<const std::string> args) {
  std::string file;
  std::string folder;
  std::string shard_text;
  std::vector<std::string> presets;
  std::int64_t jobs = 1;
  Options options("evaluate", "Runs presets over a suite of cases with known truth.");
  options.positional("SUITE.toml", file, "the suite");
  options.list("--presets", presets,
               "names, numbers or files; without it the general one of each case's kind");
  options.required("-o,--output", folder, "folder for results.jsonl, summary.json, report.html");
  options.integer("--jobs", jobs, 1, 256, "cases run at once; results do not depend on it");
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
  write_file(fs::path(folder) / "results.jsonl", lines);
  write_file(fs::path(folder) / "summary.json", summary.dump(2) + "\n");
  write_file(fs::path(folder) / "report.html", html_report(summary, results));
  print_summary(summary);
  return 0;
}

}  // namespace grapnel
