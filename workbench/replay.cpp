#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>
#include <string>
#include <system_error>

#include "base/file.h"
#include "base/input_error.h"
#include "firmware_app/snapshot.h"
#include "pipeline/preset.h"
#include "pipeline/registrar.h"
#include "workbench/commands.h"
#include "workbench/options.h"

namespace grapnel {
namespace {

namespace fs = std::filesystem;

/// A folder of its own that goes away at the end of the scope.
class ScratchFolder {
 public:
  ScratchFolder() {
    std::string pattern = (fs::temp_directory_path() / "grapnel-replay-XXXXXX").string();
    if (::mkdtemp(pattern.data()) == nullptr) {
      throw InputError(pattern + ": a temporary folder can't be made");
    }
    path_ = pattern;
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  ~ScratchFolder() {
    std::error_code none;
    fs::remove_all(path_, none);
  }
  [[nodiscard]] const fs::path& path() const noexcept { return path_; }

 private:
  fs::path path_;
};

/// The preset as the snapshot holds it, with the very models it was used with.
Preset preset_of(const PresetOrigin& origin, const std::string& models_folder) {
  if (origin.file.empty() || fs::path(origin.file).has_parent_path()) {
    throw InputError("the snapshot holds no preset");
  }
  const ScratchFolder scratch;
  const fs::path file = scratch.path() / origin.file;
  write_file(file, origin.text);
  Preset preset = load_preset(file, models_folder, origin.overrides);
  for (std::size_t i = 0; i < preset.models.size(); ++i) {
    const bool same = i < origin.models.size() && origin.models[i].hash == preset.models[i].hash;
    if (same) continue;
    throw InputError(models_folder + ": model " + preset.models[i].name +
                     " is not the one of the snapshot: its file differs (--models names a folder)");
  }
  return preset;
}

std::string run_again(const Snapshot& snapshot, const std::string& models_folder) {
  const std::unique_ptr<Registrar> registrar =
      Registrar::create(preset_of(snapshot.preset, models_folder));
  const JobEvidence& job = snapshot.evidence;
  const Result<RegistrationReports> answer = registrar->run(job.frame, job.context);
  if (!answer) return report_text(answer.error().code, answer.error().stage);
  return report_text(answer.value());
}

/// The first line in which two texts differ; empty when none does.
std::string first_difference(const std::string& before, const std::string& now) {
  std::istringstream a(before);
  std::istringstream b(now);
  for (;;) {
    std::string left;
    std::string right;
    const bool more_left = static_cast<bool>(std::getline(a, left));
    const bool more_right = static_cast<bool>(std::getline(b, right));
    if (!more_left && !more_right) return "";
    if (left != right) return "then \"" + left + "\", now \"" + right + "\"";
  }
}

}  // namespace

int run_replay(std::span<const std::string> args) {
  std::string file;
  std::optional<std::string> models;
  std::optional<std::string> output;
  bool json = false;
  Options options("replay", "Runs the job of a daemon's snapshot again and compares the answers.");
  options.positional("SNAPSHOT", file, "a file of the daemon's folder snapshots/");
  options.value("--models", models, "folder of the models; default: where the daemon had them");
  options.value("-o,--output", output, "write the new report there");
  options.flag("--json", json, "print one JSON object");
  options.footer("Exit code: 0 the report is the same byte for byte, 1 it differs.");
  if (!options.parse(args)) return 0;
  const Snapshot snapshot = read_snapshot(file);
  const std::string report = run_again(snapshot, models.value_or(snapshot.preset.models_folder));
  if (output) write_file(*output, report);
  const bool same = report == snapshot.report;
  const std::string difference = first_difference(snapshot.report, report);
  const JobEvidence& job = snapshot.evidence;
  if (json) {
    const nlohmann::ordered_json answer = {{"same", same},
                                           {"difference", difference},
                                           {"code", static_cast<unsigned>(job.result.code)},
                                           {"label", name_of(job.label)},
                                           {"part_tag", job.command.part_tag},
                                           {"preset", snapshot.preset.file},
                                           {"build", snapshot.build},
                                           {"simd", snapshot.simd}};
    std::cout << answer.dump() << "\n";
  } else {
    std::cout << file << ": job " << job.job << ", code " << static_cast<unsigned>(job.result.code)
              << ", grasp " << name_of(job.label) << ": "
              << (same ? "the same report, byte for byte" : "the report differs: " + difference)
              << "\n";
  }
  return same ? 0 : 1;
}

}  // namespace grapnel
