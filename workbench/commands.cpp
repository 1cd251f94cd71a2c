#include "workbench/commands.h"

#include <algorithm>
#include <array>
#include <exception>
#include <iomanip>
#include <iostream>
#include <string>
#include <vector>

#include "base/config.h"
#include "base/input_error.h"

namespace grapnel {
namespace {

constexpr int kUsage = 2;

constexpr std::array kCommands = {
    Command{"register", run_register,
            "move SOURCE onto TARGET and say whether the pose can be trusted"},
    Command{"register-many", run_register_many,
            "bring views into the first one's frame and fuse them"},
    Command{"filter", run_filter, "remove or merge points of a cloud"},
    Command{"normals", run_normals, "estimate a normal for every point"},
    Command{"curvature", run_curvature, "measure how every point's surroundings bend"},
    Command{"keypoints", run_keypoints, "find interest points"},
    Command{"describe", run_describe, "describe points by their surroundings"},
    Command{"match", run_match, "pair descriptors that are near"},
    Command{"reject", run_reject, "remove pairs that belong to no common motion"},
    Command{"evaluate", run_evaluate, "run presets over a suite of cases with known truth"},
    Command{"merge", run_merge, "put the results of several runs of evaluate together"},
    Command{"qualify", run_qualify, "set the limits of acceptance from labelled results"},
    Command{"tune", run_tune, "look for the preset that is best on a suite of cases"},
    Command{"teach", run_teach, "fuse frames into a model, their poses given or found"},
    Command{"calibrate", run_calibrate, "measure a sensor's errors and write its camera.toml"},
    Command{"check", run_check, "check a configuration or a preset without running it"},
    Command{"describe-preset", run_describe_preset,
            "print every key of a preset with unit, range, default and help"},
    Command{"import", run_import, "bring a foreign recording into the TUM layout"},
    Command{"doctor", run_doctor, "look for what keeps the appliance from working"},
    Command{"plc", run_plc, "a PLC emulator: triggers over Modbus and prints each result"},
    Command{"record", run_record, "record a camera's frames into a folder in the TUM layout"},
    Command{"replay", run_replay, "run a daemon's snapshot again and compare the answers"},
    Command{"simulate", run_simulate, "render a conveyor scene into a recording with its truth"},
};

void print_help() {
  std::cout << "grapnel: registers range data and tests how well\n\n"
               "Usage: grapnel COMMAND [ARGUMENTS…]; grapnel COMMAND --help says more\n\n"
               "Commands:\n";
  for (const Command& command : commands()) {
    std::cout << "  " << std::left << std::setw(18) << command.name << command.summary << "\n";
  }
  std::cout << "\nExit code: 0 success, 1 rejected or a check failed, 2 wrong usage or unreadable "
               "input\n";
}

const Command* find_command(const std::string& name) {
  for (const Command& command : commands()) {
    if (name == command.name) return &command;
  }
  return nullptr;
}

int refuse_unknown(const std::string& name) {
  std::vector<std::string> known;
  for (const Command& command : commands()) known.emplace_back(command.name);
  const std::string nearest = nearest_name(name, known);
  std::cerr << "grapnel: unknown command \"" << name << "\"";
  if (!nearest.empty()) std::cerr << "; did you mean \"" << nearest << "\"?";
  std::cerr << " (see grapnel --help)\n";
  return kUsage;
}

/// The message as one line, whatever a library put into it.
std::string one_line(std::string text) {
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text;
}

}  // namespace

std::span<const Command> commands() noexcept { return kCommands; }

int run_grapnel(std::span<const std::string> args) noexcept {
  std::string name = "grapnel";
  try {
    if (args.empty() || args[0] == "--help" || args[0] == "-h" || args[0] == "help") {
      print_help();
      return args.empty() ? kUsage : 0;
    }
    const Command* command = find_command(args[0]);
    if (command == nullptr) return refuse_unknown(args[0]);
    name += " " + args[0];
    const int code = command->run(args.subspan(1));
    std::cout.flush();
    if (!std::cout) throw InputError("standard output can't be written");
    return code;
  } catch (const std::bad_alloc&) {
    std::cerr << name << ": not enough memory\n";
  } catch (const std::exception& error) {
    std::cerr << name << ": " << one_line(error.what()) << "\n";
  }
  return kUsage;
}

}  // namespace grapnel
