#include <filesystem>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <system_error>
#include <tuple>
#include <vector>

#include "base/file.h"
#include "base/input_error.h"
#include "workbench/commands.h"
#include "workbench/evaluate/html_report.h"
#include "workbench/evaluate/stored_result.h"
#include "workbench/evaluate/summary.h"
#include "workbench/options.h"

namespace grapnel {
namespace {

namespace fs = std::filesystem;

/// Results of several runs, and what their suites were.
class Merged {
 public:
  void add(const std::string& folder) {
    read_suite(fs::path(folder) / "summary.json");
    const std::string file = (fs::path(folder) / "results.jsonl").string();
    std::ifstream stream(file);
    if (!stream) throw InputError(file + ": can't be read");
    std::string line;
    for (std::size_t number = 1; std::getline(stream, line); ++number) {
      const std::string where = file + ":" + std::to_string(number) + ": ";
      try {
        results.push_back(stored_result(nlohmann::json::parse(line)));
      } catch (const nlohmann::json::exception& error) {
        throw InputError(where + "a line of results.jsonl is expected: " + error.what());
      } catch (const InputError& error) {
        throw InputError(where + error.what());
      }
      refuse_repeated(where);
      lines.append(line).append("\n");
    }
  }

  Suite suite;
  std::vector<CaseResult> results;
  std::string lines;

 private:
  void read_suite(const fs::path& file) {
    std::ifstream stream(file);
    if (!stream) throw InputError(file.string() + ": can't be read");
    try {
      const nlohmann::json summary = nlohmann::json::parse(stream);
      const Suite other = {summary.at("suite").get<std::string>(),
                           summary.at("tolerance_m").get<double>(),
                           summary.at("tolerance_rad").get<double>(),
                           {}};
      if (results.empty() && lines.empty()) suite = other;
      if (other.tolerance_m != suite.tolerance_m || other.tolerance_rad != suite.tolerance_rad) {
        throw InputError(file.string() + ": other tolerances than the first folder's");
      }
      if (other.name != suite.name) suite.name = "merged";
    } catch (const nlohmann::json::exception& error) {
      throw InputError(file.string() + ": a summary.json is expected: " + error.what());
    }
  }

  /// A frame counts once: the seed is its hash, which an error or an empty belt does not have.
  void refuse_repeated(const std::string& where) {
    const CaseResult& result = results.back();
    if (result.failed() || result.answer.seed == 0) return;
    if (!known_.insert({result.id, result.preset, result.answer.seed}).second) {
      throw InputError(where + "\"" + result.id + "\" was in an earlier folder with the same data");
    }
  }

  std::set<std::tuple<std::string, std::string, std::uint32_t>> known_;
};

}  // namespace

int run_merge(std::span<const std::string> args) {
  std::vector<std::string> folders;
  std::string output;
  Options options("merge", "Puts the results of several runs of evaluate together.");
  options.positionals("RESULT", folders, 1, "folders that evaluate wrote: shards, or other suites");
  options.required("-o,--output", output, "folder for results.jsonl, summary.json, report.html");
  if (!options.parse(args)) return 0;
  Merged merged;
  for (const std::string& folder : folders) merged.add(folder);
  std::error_code code;
  fs::create_directories(output, code);
  if (code) throw InputError(output + ": can't be made: " + code.message());
  const nlohmann::ordered_json summary = summary_of(merged.suite, merged.results);
  write_file(fs::path(output) / "results.jsonl", std::string_view(merged.lines));
  write_file(fs::path(output) / "summary.json", std::string_view(summary.dump(2) + "\n"));
  write_file(fs::path(output) / "report.html",
             std::string_view(html_report(summary, merged.results, {})));
  print_summary(summary);
  return 0;
}

}  // namespace grapnel
