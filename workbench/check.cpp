#include <cstdio>
#include <filesystem>
#include <iostream>
#include <string>
#include <system_error>
#include <vector>

#include "base/config.h"
#include "base/input_error.h"
#include "firmware_app/memory_plan.h"
#include "firmware_app/settings.h"
#include "pipeline/preset.h"
#include "pipeline/registrar.h"
#include "workbench/commands.h"
#include "workbench/options.h"
#include "workbench/presets.h"

namespace grapnel {
namespace {

/// grapnel.toml names a camera; a preset never does.
bool is_settings(const ConfigTable& table) {
  for (const char* key : {"camera", "fieldbus", "active_preset", "capture"}) {
    if (table.find(key) != nullptr) return true;
  }
  return false;
}

int check_preset(const std::filesystem::path& file, const std::vector<std::string>& overrides) {
  const Preset preset = load_preset(file, models_folder(file), overrides);
  std::size_t sum = 0;
  std::printf("preset %s, %zu models, bytes\n", preset.name.c_str(), preset.models.size());
  for (const MemoryItem& item : Registrar::plan(preset)) {
    std::printf("  %-32s %12zu\n", item.part.c_str(), item.bytes);
    sum += item.bytes;
  }
  std::printf("  %-32s %12zu\n", "sum", sum);
  return 0;
}

}  // namespace

int run_check(std::span<const std::string> args) {
  std::string file;
  std::vector<std::string> overrides;
  Options options("check",
                  "Checks a grapnel.toml with all of its presets, or one preset, by the daemon's "
                  "own code. Exit code 1 when it is refused.");
  options.positional("CONFIG", file, "grapnel.toml, or a preset by file, name or number");
  options.repeated("--set", overrides, "key=value over the file's; repeatable");
  if (!options.parse(args)) return 0;

  const bool by_path = file.ends_with(".toml") || file.find('/') != std::string::npos;
  const std::filesystem::path path = by_path ? std::filesystem::path(file) : preset_file(file);
  std::error_code code;
  if (!std::filesystem::is_regular_file(path, code)) {
    throw InputError(path.string() + ": no such file");
  }
  try {
    if (is_settings(load_config(path))) return run_check(load_settings(path, overrides));
    return check_preset(path, overrides);
  } catch (const InputError& problem) {
    std::cout.flush();
    std::cerr << problem.what() << "\n";
    return 1;
  }
}

}  // namespace grapnel
