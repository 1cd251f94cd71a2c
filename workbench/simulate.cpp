#include <cstdint>
#include <filesystem>
#include <iostream>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/config.h"
#include "drivers/synthetic/scene.h"
#include "workbench/commands.h"
#include "workbench/options.h"
#include "workbench/progress.h"
#include "workbench/simulate/scene_help.h"
#include "workbench/simulate/simulated_recording.h"

namespace grapnel {

int run_simulate(std::span<const std::string> args) {
  std::string scene_file;
  std::string folder;
  std::optional<std::string> seed;
  std::optional<std::string> frames;
  std::vector<std::string> overrides;
  Options options("simulate",
                  "Renders a conveyor scene into a recording, with the truth beside it.");
  options.positional("SCENE.toml", scene_file, "the scene");
  options.required("-o,--output", folder, "folder of the recording; must not hold one yet");
  options.value("--seed", seed, "of everything random, instead of the scene's");
  options.value("--frames", frames, "length, instead of the scene's");
  options.repeated("--set", overrides, "key=value, as camera.height_m=1.0; may be repeated");
  options.footer(scene_help());
  if (!options.parse(args)) return 0;
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
