#include <cstdio>
#include <exception>
#include <span>
#include <string>
#include <vector>

#include "base/input_error.h"
#include "drivers/registry.h"
#include "firmware_app/daemon.h"
#include "firmware_app/memory_plan.h"
#include "firmware_app/options.h"
#include "pipeline/registrar.h"

namespace grapnel {
namespace {

int list_cameras() {
  std::fputs(camera_list().c_str(), stdout);
  return 0;
}

int check(const DaemonOptions& options) {
  if (!std::filesystem::exists(options.config)) {
    throw InputError(options.config.string() + ": there is no such file");
  }
  try {
    return run_check(load_settings(options.config, options.overrides));
  } catch (const InputError& problem) {
    std::fprintf(stderr, "%s\n", problem.what());
    return 1;
  }
}

int run(std::span<const std::string> arguments) {
  const DaemonOptions options = parse_daemon_options(arguments);
  if (!options.simd.empty() && !Registrar::force_simd_target(options.simd)) {
    throw InputError("--simd " + options.simd + ": not in this build or on this machine");
  }
  switch (options.task) {
    case DaemonOptions::Task::Help:
      std::fputs(daemon_help().c_str(), stdout);
      return 0;
    case DaemonOptions::Task::Version:
      std::printf("grapneld %s\n", version_text());
      return 0;
    case DaemonOptions::Task::ListCameras:
      return list_cameras();
    case DaemonOptions::Task::Check:
      return check(options);
    case DaemonOptions::Task::Run:
      return run_daemon(options);
  }
  return 2;
}

}  // namespace
}  // namespace grapnel

int main(int count, char** values) {
  const std::vector<std::string> arguments(values + 1, values + count);
  try {
    return grapnel::run(arguments);
  } catch (const grapnel::InputError& problem) {
    std::fprintf(stderr, "grapneld: %s\n", problem.what());
    return 2;
  } catch (const std::exception& problem) {
    std::fprintf(stderr, "grapneld: %s\n", problem.what());
    return 1;
  }
}
