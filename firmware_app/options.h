#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace grapnel {

/// What grapneld was called with.
struct DaemonOptions {
  enum class Task { Run, Check, Help, Version, ListCameras };
  Task task = Task::Run;
  std::filesystem::path config = "/etc/grapnel/grapnel.toml";
  std::string simd;                    ///< "" = the best one
  std::vector<std::string> overrides;  ///< "table.key=value"
};

/// Throws InputError on wrong usage.
[[nodiscard]] DaemonOptions parse_daemon_options(std::span<const std::string> arguments);

/// The text of --help.
[[nodiscard]] std::string daemon_help();

}  // namespace grapnel
