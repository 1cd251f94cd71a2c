#include <cstdio>
#include <filesystem>
#include <iostream>
#include <string>
#include <system_error>
#include <variant>
#include <vector>

#include "base/config_text.h"
#include "base/file.h"
#include "base/input_error.h"
#include "pipeline/preset.h"
#include "workbench/commands.h"
#include "workbench/evaluate/run_cases.h"
#include "workbench/evaluate/statistics.h"
#include "workbench/options.h"
#include "workbench/presets.h"
#include "workbench/tune/race.h"
#include "workbench/tune/space.h"

namespace grapnel {
namespace {

namespace fs = std::filesystem;

constexpr const char* kHelp =
    "Keys of SPACE.toml:\n"
    "  base = \"\": preset to start from; by default the general one of the suite's kind\n"
    "  draws = 32 (1 to 10000): combinations tried; all where there are no more\n"
    "  seed = 1: of the combinations drawn and the order of cases\n"
    "[keys], any of describe-preset with a list of values each:\n"
    "  descriptors.method = [\"fpfh\", \"spin_image\"]\n"
    "  search.kept = [12, 24, 48]\n\n"
    "A race: every combination runs on some cases, the better half on twice as many, and so on. "
    "Best\n"
    "is what accepts fewest wrong poses, then most right ones, then finds most, then errs least.\n"
    "The base takes part. Measure the winner on cases that it was not tuned on.";

CaseKind kind_of(const Suite& suite, const std::string& file) {
  if (suite.cases.empty()) throw InputError(file + ": no case");
  for (const SuiteCase& one : suite.cases) {
    if (one.kind == CaseKind::Many || one.kind != suite.cases[0].kind) {
      throw InputError(file + ": case " + one.id + " is of kind " + kind_name(one.kind) +
                       "; all of kind scene or all of kind pair are allowed");
    }
  }
  return suite.cases[0].kind;
}

/// Before hours are spent on what can't be kept.
void require_folder_of(const fs::path& file) {
  const fs::path folder = fs::absolute(file).parent_path();
  std::error_code ignored;
  if (!fs::is_directory(folder, ignored)) {
    throw InputError(file.string() + ": no folder " + folder.string());
  }
}

std::string joined(const Combination& combination) {
  if (combination.empty()) return "the base as it is";
  std::string text;
  for (const std::string& assignment : combination) text += (text.empty() ? "" : " ") + assignment;
  return text;
}

/// "accepted right 12 (found 13), wrong 0 of 16 cases, median error 0.8 mm, p50 14 ms".
std::string tally_text(const Tally& tally) {
  std::string text = "accepted right " + std::to_string(tally.accepted_right) + " (found " +
                     std::to_string(tally.found) + "), wrong " +
                     std::to_string(tally.accepted_wrong) + " of " + std::to_string(tally.cases) +
                     " cases";
  if (tally.failed > 0) text += ", failed " + std::to_string(tally.failed);
  char numbers[80];
  if (tally.found > 0) {
    std::snprintf(numbers, sizeof numbers, ", median error %.2f mm",
                  quantile(tally.error_m, 0.5) * 1e3);
    text += numbers;
  }
  std::snprintf(numbers, sizeof numbers, ", p50 %.1f ms", quantile(tally.total_ms, 0.5));
  return text + numbers;
}

/// A preset as people write one: a line a key, each step under its head.
std::string lines_of(const ConfigTable& table) {
  std::string plain;
  std::string steps;
  for (const auto& [key, value] : table.entries()) {
    const auto* tables = std::get_if<std::vector<ConfigTable>>(&value.data);
    if (tables == nullptr) {
      plain += key + " = " + toml_text(value) + "\n";
      continue;
    }
    for (const ConfigTable& step : *tables) {
      steps += tables->size() == 1 ? "\n[" + key + "]\n" : "\n[[" + key + "]]\n";
      for (const auto& [name, inner] : step.entries()) {
        steps += name + " = " + toml_text(inner) + "\n";
      }
    }
  }
  return plain + steps;
}

/// The base with the winner's values, saying where they come from.
std::string preset_text(const fs::path& base, const Combination& winner, const Suite& suite,
                        const Space& space, const std::string& result) {
  ConfigTable table = load_config(base);
  for (const std::string& assignment : winner) apply_override(table, assignment);
  return "# Tuned from " + base.filename().string() + " on the suite \"" + one_line(suite.name) +
         "\", seed " + std::to_string(space.seed) + ":\n# " + joined(winner) + "\n# " + result +
         "\n" + lines_of(table);
}

}  // namespace

int run_tune(std::span<const std::string> args) {
  std::string suite_file;
  std::string space_file;
  std::string output;
  std::int64_t jobs = 1;
  Options options("tune", "Looks for the preset that is best on a suite of cases.");
  options.positional("SUITE.toml", suite_file, "the suite");
  options.required("--space", space_file, "SPACE.toml: the keys and values to be tried");
  options.required("-o,--output", output, "PRESET.toml, the best one found");
  options.integer("--jobs", jobs, 1, 256, "cases run at once; results do not depend on it");
  options.footer(kHelp);
  if (!options.parse(args)) return 0;

  require_folder_of(output);
  const Suite suite = load_suite(suite_file);
  const CaseKind kind = kind_of(suite, suite_file);
  const Space space = load_space(space_file);
  const fs::path base = preset_file(space.base.empty() ? general_preset(kind) : space.base);
  std::vector<Combination> contestants = combinations(space, base);
  contestants.insert(contestants.begin(), Combination{});

  const auto run = [&](std::span<const Heat> heats) {
    std::vector<CaseRun> runs;
    for (const Heat& heat : heats) {
      runs.push_back({&suite.cases[heat.case_i], base.string(), contestants[heat.contestant]});
    }
    return run_cases(suite, runs, static_cast<std::size_t>(jobs), "tune");
  };
  const std::vector<Standing> left =
      race(contestants.size(), suite.cases, Rng(space.seed).split(1), run);

  std::cout << contestants.size() - 1 << " combinations and the base raced on "
            << suite.cases.size() << " cases; best first, of those that ran on all:\n";
  for (const Standing& standing : left) {
    std::cout << "  " << tally_text(standing.tally) << ": "
              << joined(contestants[standing.contestant]) << "\n";
  }
  const Standing& best = left.front();
  const std::string result = tally_text(best.tally);
  write_file(output, std::string_view(preset_text(base, contestants[best.contestant], suite, space,
                                                  result.substr(0, result.rfind(", p50")))));
  std::cout << "written: " << output << "; measure it on cases that it was not tuned on\n";
  return best.tally.accepted_wrong == 0 ? 0 : 1;
}

}  // namespace grapnel
