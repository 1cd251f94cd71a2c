#include <algorithm>
#include <charconv>
#include <cstdint>
#include <filesystem>
#include <iostream>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include "base/config.h"
#include "base/input_error.h"
#include "drivers/synthetic/scene.h"
#include "workbench/commands.h"
#include "workbench/options.h"
#include "workbench/progress.h"
#include "workbench/simulate/qualification_set.h"
#include "workbench/simulate/scene_help.h"
#include "workbench/simulate/simulated_recording.h"

namespace grapnel {
namespace {

std::string names(std::span<const std::string_view> all) {
  std::string text;
  for (const std::string_view name : all) text.append(text.empty() ? "" : ", ").append(name);
  return text;
}

std::size_t choice(const std::string& option, const std::string& text,
                   std::span<const std::string_view> all) {
  const auto found = std::find(all.begin(), all.end(), text);
  if (found == all.end()) throw InputError(option + " " + text + ": " + names(all) + " is allowed");
  return static_cast<std::size_t>(found - all.begin());
}

std::uint64_t parse_seed(const std::string& text) {
  std::uint64_t seed = 0;
  const char* end = text.data() + text.size();
  const auto parsed = std::from_chars(text.data(), end, seed);
  if (parsed.ec != std::errc() || parsed.ptr != end) {
    throw InputError("--seed " + text + ": a whole number from 0 is allowed");
  }
  return seed;
}

int simulate_set(const QualificationParams& params, const std::string& folder) {
  const int cases = params.positives + params.either + params.negatives;
  Progress progress("simulate", static_cast<std::size_t>(cases));
  write_qualification_set(params, folder, [&progress] { progress.step(); });
  std::cout << folder << ": " << cases << " cases of " << params.instances << " instances\n";
  return 0;
}

}  // namespace

int run_simulate(std::span<const std::string> args) {
  std::vector<std::string> scene_files;
  std::string part;
  std::string split = "tune";
  QualificationParams set;
  std::int64_t instances = set.instances;
  std::int64_t positives = set.positives;
  std::int64_t either = set.either;
  std::int64_t negatives = set.negatives;
  std::string folder;
  std::optional<std::string> seed;
  std::optional<std::string> frames;
  std::vector<std::string> overrides;
  Options options("simulate",
                  "Renders a conveyor scene into a recording, or a set of labelled cases.");
  options.positionals("SCENE.toml", scene_files, 0, "the scene; or see --set-of");
  options.required("-o,--output", folder, "folder of the recording; must not hold one yet");
  options.value("--seed", seed, "of everything random, instead of the scene's");
  options.value("--frames", frames, "length, instead of the scene's");
  options.repeated("--set", overrides, "key=value, as camera.height_m=1.0; may be repeated");
  options.value(
      "--set-of", part,
      "instead of a scene: a set of labelled cases of a part, with models and suite.toml: " +
          names(kPartClassNames));
  options.value("--split", split, "of the set; instances are in one only: " + names(kSplitNames));
  options.integer("--instances", instances, 1, 1000, "objects of the set");
  options.integer("--positives", positives, 0, 1000000, "cases with the part in plain view");
  options.integer("--either", either, 0, 1000000, "cases with it half hidden or touched");
  options.integer("--negatives", negatives, 0, 1000000, "cases without it");
  options.footer(scene_help());
  if (!options.parse(args)) return 0;
  if (part.empty() == scene_files.empty() || scene_files.size() > 1) {
    throw InputError("simulate: one SCENE.toml or --set-of PART is allowed");
  }
  if (!part.empty() && (!overrides.empty() || frames)) {
    throw InputError((frames ? "--frames " + *frames : "--set " + overrides.front()) +
                     ": is of a SCENE.toml; a set's scenes are its own, and --set-of takes "
                     "--split, --instances, --positives, --either, --negatives and --seed");
  }
  if (!part.empty()) {
    set.part = static_cast<PartClass>(choice("--set-of", part, kPartClassNames));
    set.split = static_cast<Split>(choice("--split", split, kSplitNames));
    set.instances = static_cast<int>(instances);
    set.positives = static_cast<int>(positives);
    set.either = static_cast<int>(either);
    set.negatives = static_cast<int>(negatives);
    if (seed) set.seed = parse_seed(*seed);
    return simulate_set(set, folder);
  }
  const std::string& scene_file = scene_files.front();
  ConfigTable table = load_config(scene_file);
  if (seed) overrides.push_back("scene.seed=" + *seed);
  if (frames) overrides.push_back("scene.frames=" + *frames);
  for (const std::string& assignment : overrides) apply_override(table, assignment);
  const Scene scene = read_scene(table, std::filesystem::path(scene_file).parent_path());
  Progress progress("simulate", static_cast<std::size_t>(scene.frames));
  const SimulationCounts counts =
      write_simulated_recording(scene, folder, [&progress] { progress.step(); });
  std::cout << folder << ": " << counts.depth_images << " of " << counts.frames << " frames, "
            << counts.events << " events\n";
  return 0;
}

}  // namespace grapnel
