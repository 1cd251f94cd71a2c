// Reads the #include lines of the whole tree and holds them against the picture in README.md.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <string>
#include <vector>

namespace grapnel {
namespace {

namespace fs = std::filesystem;

const fs::path kRoot = GRAPNEL_SOURCE_DIR;
const std::vector<std::string> kFolders = {"base",     "hal",          "drivers",
                                           "pipeline", "firmware_app", "workbench"};

struct Include {
  fs::path file;     // relative to the root
  std::string name;  // as written
  bool ours = false;
};

std::vector<Include> includes_of(const fs::path& folder) {
  static const std::regex kLine(R"re(^\s*#\s*include\s*([<"])([^>"]+)[>"])re");
  std::vector<Include> found;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(kRoot / folder)) {
    const std::string extension = entry.path().extension();
    if (extension != ".h" && extension != ".cpp") continue;
    std::ifstream stream(entry.path());
    for (std::string line; std::getline(stream, line);) {
      std::smatch match;
      if (!std::regex_search(line, match, kLine)) continue;
      // Highway's headers that are read again for every target are named in quotes.
      const bool ours = match[1] == "\"" && !match[2].str().starts_with("hwy/");
      found.push_back({fs::relative(entry.path(), kRoot), match[2], ours});
    }
  }
  return found;
}

std::string first_part(const std::string& path) { return path.substr(0, path.find('/')); }

TEST(Layering, FoldersIncludeOnlyWhatTheArrowsAllow) {
  const std::map<std::string, std::set<std::string>> allowed = {
      {"base", {"base"}},
      {"hal", {"hal", "base"}},
      {"drivers", {"drivers", "hal", "base"}},
      {"pipeline", {"pipeline", "base"}},
      {"firmware_app", {"firmware_app", "drivers", "pipeline", "hal", "base"}},
      {"workbench", {"workbench", "firmware_app", "drivers", "pipeline", "hal", "base"}},
  };
  int seen = 0;
  for (const auto& [folder, targets] : allowed) {
    for (const Include& include : includes_of(folder)) {
      if (!include.ours) continue;
      ++seen;
      EXPECT_TRUE(targets.contains(first_part(include.name)))
          << include.file << " includes \"" << include.name << '"';
    }
  }
  EXPECT_GT(seen, 50) << "the test no longer reads the tree";
}

TEST(Layering, TheWorkbenchTakesOfTheDaemonOnlyWhatReadsItsFiles) {
  for (const Include& include : includes_of("workbench")) {
    if (!include.ours || first_part(include.name) != "firmware_app") continue;
    EXPECT_TRUE(
        include.name == "firmware_app/settings.h" || include.name == "firmware_app/memory_plan.h" ||
        include.name == "firmware_app/preset_source.h" || include.name == "firmware_app/snapshot.h")
        << include.file << " includes " << include.name;
  }
}

TEST(Layering, ADriverKnowsNoOtherDriver) {
  for (const Include& include : includes_of("drivers")) {
    if (!include.ours || first_part(include.name) != "drivers") continue;
    const fs::path below = fs::relative(include.file, "drivers");
    if (!below.has_parent_path()) continue;  // the registry knows all
    const std::string own = first_part(below);
    const std::string other = first_part(include.name.substr(std::string("drivers/").size()));
    if (other == "replay" && own == "synthetic") continue;
    // What drivers of real cameras share, and what plays .oni files for a driver and for import.
    if (other == "live" || other == "oni") continue;
    EXPECT_TRUE(other == own || other.ends_with(".h"))
        << include.file << " includes " << include.name;
  }
}

TEST(Layering, ForeignLibrariesStayInTheirPlace) {
  const std::vector<std::pair<std::regex, std::vector<std::string>>> rules = {
      {std::regex("^toml\\+\\+/.*"), {"base/config.cpp"}},
      {std::regex("^(png|jpeglib|zlib)\\.h"), {"drivers/replay/"}},
      {std::regex("^modbus/.*|^modbus\\.h"), {"drivers/modbus/"}},
      {std::regex("^hwy/.*"), {"pipeline/kernels/"}},
      {std::regex("^nanoflann\\.hpp"), {"pipeline/"}},
      {std::regex("^opencv.*"), {"workbench/"}},
      {std::regex("^nlohmann/.*"), {"workbench/"}},
      {std::regex("^CLI/.*"), {"workbench/", "firmware_app/"}},
      {std::regex("^OpenNI.*"), {"drivers/openni2/"}},
      {std::regex("^libfreenect.*"), {"drivers/freenect/"}},
  };
  for (const std::string& folder : kFolders) {
    for (const Include& include : includes_of(folder)) {
      for (const auto& [pattern, places] : rules) {
        if (!std::regex_match(include.name, pattern)) continue;
        bool inside = false;
        for (const std::string& place : places) inside |= include.file.string().starts_with(place);
        EXPECT_TRUE(inside) << include.file << " includes <" << include.name << '>';
      }
    }
  }
}

TEST(Layering, NothingBelowTheProgramsPrintsOrExits) {
  static const std::regex kPrints(
      R"(\b(printf|fprintf|puts|std::cout|std::cerr|std::exit|exit)\s*[(<])");
  for (const std::string folder : {"base", "hal", "pipeline"}) {
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(kRoot / folder)) {
      const std::string extension = entry.path().extension();
      if (extension != ".h" && extension != ".cpp") continue;
      std::ifstream stream(entry.path());
      for (std::string line; std::getline(stream, line);) {
        EXPECT_FALSE(std::regex_search(line, kPrints)) << entry.path() << ": " << line;
      }
    }
  }
}

}  // namespace
}  // namespace grapnel
