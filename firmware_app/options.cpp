#include "firmware_app/options.h"

#include "base/config.h"
#include "base/input_error.h"

namespace grapnel {
namespace {

const std::vector<std::string>& known_options() {
  static const std::vector<std::string> known = {"--config", "--check",   "--simd",        "--set",
                                                 "--help",   "--version", "--list-cameras"};
  return known;
}

}  // namespace

DaemonOptions parse_daemon_options(std::span<const std::string> arguments) {
  DaemonOptions options;
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    std::string name = arguments[i];
    std::string value;
    bool has_value = false;
    if (const std::size_t equals = name.find('=');
        name.starts_with("--") && equals != std::string::npos) {
      value = name.substr(equals + 1);
      name.resize(equals);
      has_value = true;
    }
    const auto take_value = [&]() -> const std::string& {
      if (has_value) return value;
      if (i + 1 == arguments.size()) throw InputError(name + ": a value must follow");
      value = arguments[++i];
      has_value = true;
      return value;
    };
    if (name == "--config") {
      options.config = take_value();
    } else if (name == "--simd") {
      options.simd = take_value();
    } else if (name == "--set") {
      options.overrides.push_back(take_value());
    } else if (name == "--check") {
      options.task = DaemonOptions::Task::Check;
    } else if (name == "--help" || name == "-h") {
      options.task = DaemonOptions::Task::Help;
    } else if (name == "--version") {
      options.task = DaemonOptions::Task::Version;
    } else if (name == "--list-cameras") {
      options.task = DaemonOptions::Task::ListCameras;
    } else {
      const std::string nearest = nearest_name(name, known_options());
      throw InputError(name + ": unknown option" +
                       (nearest.empty() ? std::string() : "; did you mean " + nearest + "?"));
    }
  }
  return options;
}

std::string daemon_help() {
  return "usage: grapneld --config FILE [--check] [--simd NAME] [--set TABLE.KEY=VALUE]…\n"
         "\n"
         "Finds taught parts in a depth camera's frames when the PLC triggers, and answers over\n"
         "Modbus.\n"
         "\n"
         "  --config FILE     grapnel.toml (default /etc/grapnel/grapnel.toml)\n"
         "  --check           check configuration, presets and models, print the memory plan, "
         "exit\n"
         "  --simd NAME       force a SIMD target of the pipeline\n"
         "  --set KEY=VALUE   overrides a key of grapnel.toml; may be repeated\n"
         "  --list-cameras    print the camera drivers and the devices they see, exit\n"
         "  --version         print the version, exit\n"
         "  --help            print this, exit\n"
         "\n"
         "Exit status: 0 done, 1 a check failed or the daemon could not go on, 2 wrong usage or\n"
         "unreadable input. SIGTERM ends it, SIGHUP reloads the configuration.\n";
}

}  // namespace grapnel
