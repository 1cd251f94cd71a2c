#pragma once

#include <cstdlib>
#include <filesystem>

namespace grapnel::test {

inline constexpr const char* kNoRecordedData = "GRAPNEL_DATA does not name the recorded data";

/// `name` inside the recorded data's folder; empty when the environment names none or it is not
/// there. A test then skips with kNoRecordedData.
[[nodiscard]] inline std::filesystem::path recorded_data(const char* name) {
  const char* const root = std::getenv("GRAPNEL_DATA");
  if (root == nullptr || *root == '\0') return {};
  std::filesystem::path path = std::filesystem::path(root) / name;
  return std::filesystem::exists(path) ? path : std::filesystem::path();
}

}  // namespace grapnel::test
