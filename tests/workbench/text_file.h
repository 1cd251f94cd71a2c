#pragma once

#include <filesystem>
#include <fstream>
#include <iterator>
#include <span>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "workbench/commands.h"

namespace grapnel::test {

/// Writes a file and answers its path.
inline std::string write_text(const std::filesystem::path& file, const std::string& text) {
  std::ofstream(file, std::ios::binary) << text;
  return file.string();
}

/// The whole text of a file, "" when it is not there.
inline std::string text_of(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

/// What `grapnel ARGS…` answers.
struct CommandRun {
  int code = 0;
  std::string out;
  std::string error;
};

inline CommandRun run_command(const std::vector<std::string>& args) {
  testing::internal::CaptureStdout();
  testing::internal::CaptureStderr();
  CommandRun run;
  run.code = run_grapnel(args);
  run.out = testing::internal::GetCapturedStdout();
  run.error = testing::internal::GetCapturedStderr();
  return run;
}

}  // namespace grapnel::test
