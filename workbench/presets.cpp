#include "workbench/presets.h"

#include <charconv>
#include <system_error>
#include <vector>

#include "base/input_error.h"
#include "pipeline/preset.h"

namespace grapnel {
namespace {

namespace fs = std::filesystem;

bool has_presets(const fs::path& folder) {
  std::error_code ignored;
  return fs::is_directory(folder / "presets", ignored);
}

}  // namespace

fs::path config_folder() {
  std::vector<fs::path> candidates = {fs::current_path() / "config"};
  std::error_code code;
  const fs::path program = fs::read_symlink("/proc/self/exe", code);
  for (fs::path folder = program.parent_path(); !code; folder = folder.parent_path()) {
    candidates.push_back(folder / "config");
    candidates.push_back(folder / "share" / "grapnel");
    if (folder == folder.parent_path()) break;
  }
  for (const fs::path& candidate : candidates) {
    if (has_presets(candidate)) return candidate;
  }
  throw InputError("no folder config/presets here nor above the program; give presets by path");
}

fs::path preset_file(const std::string& preset) {
  std::error_code ignored;
  if (preset.ends_with(".toml") || preset.find('/') != std::string::npos) {
    if (!fs::is_regular_file(preset, ignored)) {
      throw InputError("preset " + preset + ": no such file");
    }
    return preset;
  }
  const fs::path folder = config_folder() / "presets";
  std::uint16_t number = 0;
  const char* end = preset.data() + preset.size();
  const auto [stop, error] = std::from_chars(preset.data(), end, number);
  return error == std::errc() && stop == end ? find_preset(folder, number)
                                             : find_preset(folder, preset);
}

fs::path models_folder(const fs::path& preset) {
  // presets/NN-name.toml has its models in the neighbouring folder models/.
  const fs::path beside = fs::absolute(preset).parent_path().parent_path() / "models";
  std::error_code ignored;
  return fs::is_directory(beside, ignored) ? beside : fs::absolute(preset).parent_path();
}

}  // namespace grapnel
