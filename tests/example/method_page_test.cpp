// docs/adding-a-method.md quotes a detector's files; what it quotes must be what is there.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>
#include <string>

namespace grapnel {
namespace {

std::string text_of(const std::string& file) {
  std::ifstream stream(std::filesystem::path(GRAPNEL_SOURCE_DIR) / file);
  return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

TEST(MethodPage, ShowsTheFilesOfTheDetectorAsTheyAre) {
  std::istringstream page(text_of("docs/adding-a-method.md"));
  std::string line;
  std::string file;
  std::string added;
  bool whole = false;
  int blocks = 0;
  while (std::getline(page, line)) {
    if (line == "```diff") {
      file.clear();
      added.clear();
      whole = false;
    } else if (line == "```" && !file.empty()) {
      const std::string there = text_of(file);
      EXPECT_TRUE(whole ? there == added : there.find(added) != std::string::npos) << file;
      file.clear();
      ++blocks;
    } else if (line.starts_with("+++ b/")) {
      file = line.substr(6);
    } else if (line.starts_with("@@ -0,0")) {
      whole = true;
    } else if (line.starts_with("+")) {
      added += line.substr(1) + "\n";
    }
  }
  EXPECT_EQ(blocks, 3);
}

}  // namespace
}  // namespace grapnel
