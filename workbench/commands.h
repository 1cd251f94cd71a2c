#pragma once

#include <span>
#include <string>

namespace grapnel {

// One function a subcommand, in a file of its name. Each takes the arguments after the command's
// name and returns the exit code: 0 success (register: accepted), 1 "rejected" or a check that
// failed. Wrong usage and unreadable input are thrown as InputError, which main() turns into one
// line on stderr and exit code 2. A new command needs its line here and one in commands.cpp.

/// A row of the table of subcommands.
struct Command {
  const char* name;
  int (*run)(std::span<const std::string> args);
  const char* summary;  ///< half a sentence for `grapnel --help`
};

int run_calibrate(std::span<const std::string> args);
int run_check(std::span<const std::string> args);
int run_curvature(std::span<const std::string> args);
int run_describe(std::span<const std::string> args);
int run_describe_preset(std::span<const std::string> args);
int run_doctor(std::span<const std::string> args);
int run_evaluate(std::span<const std::string> args);
int run_qualify(std::span<const std::string> args);
int run_filter(std::span<const std::string> args);
int run_import(std::span<const std::string> args);
int run_keypoints(std::span<const std::string> args);
int run_match(std::span<const std::string> args);
int run_merge(std::span<const std::string> args);
int run_normals(std::span<const std::string> args);
int run_plc(std::span<const std::string> args);
int run_record(std::span<const std::string> args);
int run_register(std::span<const std::string> args);
int run_register_many(std::span<const std::string> args);
int run_reject(std::span<const std::string> args);
int run_replay(std::span<const std::string> args);
int run_simulate(std::span<const std::string> args);
int run_teach(std::span<const std::string> args);
int run_tune(std::span<const std::string> args);

/// Every subcommand, in the order of `grapnel --help`.
[[nodiscard]] std::span<const Command> commands() noexcept;

/// Runs `grapnel ARGS…`; what main() returns. Writes errors to stderr and never throws.
int run_grapnel(std::span<const std::string> args) noexcept;

}  // namespace grapnel
