#include <filesystem>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "base/file.h"
#include "base/input_error.h"
#include "workbench/commands.h"
#include "workbench/options.h"
#include "workbench/qualify/calibration.h"

namespace grapnel {
namespace {

/// The pose of a line of results.jsonl, or none where the line found none.
void add_pose(const nlohmann::json& line, std::vector<LabelledPose>& poses) {
  if (!line.contains("transform") || !line.contains("checks")) return;
  LabelledPose pose;
  pose.id = line.at("id").get<std::string>();
  pose.right = line.at("right").get<bool>();
  // Half hidden or touched parts need not pass: their right poses set no limit.
  if (pose.right && line.at("expect").get<std::string>() != "accept") return;
  for (std::size_t i = 0; i < kLimitedChecks.size(); ++i) {
    const auto found = line["checks"].find(kLimitedChecks[i].check);
    if (found != line["checks"].end()) pose.measured[i] = found->get<double>();
  }
  poses.push_back(std::move(pose));
}

void read_results(const std::string& file, std::vector<LabelledPose>& poses) {
  std::ifstream stream(file);
  if (!stream) throw InputError(file + ": can't be read");
  std::string text;
  for (std::size_t number = 1; std::getline(stream, text); ++number) {
    try {
      add_pose(nlohmann::json::parse(text), poses);
    } catch (const nlohmann::json::exception& error) {
      throw InputError(file + ":" + std::to_string(number) +
                       ": a line of results.jsonl is expected: " + error.what());
    }
  }
}

}  // namespace

int run_qualify(std::span<const std::string> args) {
  std::vector<std::string> files;
  std::string output;
  Options options("qualify", "Sets the limits of acceptance from labelled results.");
  options.positionals("RESULTS.jsonl", files, 1, "of grapnel evaluate, of one preset");
  options.value("-o,--output", output, "write the table [accept] there, for a preset");
  if (!options.parse(args)) return 0;
  std::vector<LabelledPose> poses;
  for (const std::string& file : files) read_results(file, poses);
  const Calibration calibration = calibrate(poses);
  if (calibration.right == 0) {
    throw InputError("qualify: no right pose of a case to accept in the results");
  }
  const std::string table = accept_table(calibration);
  std::cout << table;
  for (const std::string& id : calibration.inseparable) {
    std::cout << "# not to be told from right ones by any check: " << id << "\n";
  }
  if (!output.empty()) write_file(output, std::string_view(table));
  return calibration.inseparable.empty() ? 0 : 1;
}

}  // namespace grapnel
