#include "pipeline/preset.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "base/config.h"
#include "base/input_error.h"
#include "pipeline/method_slots.h"
#include "pipeline/registrar.h"
#include "tests/support/temp_folder.h"

namespace grapnel {
namespace {

namespace fs = std::filesystem;

const fs::path kConfig = fs::path(GRAPNEL_SOURCE_DIR) / "config";

class PresetFile : public testing::Test {
 protected:
  fs::path write(const std::string& text, const std::string& name = "21-test.toml") {
    fs::path file = folder_.path() / name;
    std::ofstream(file) << text;
    return file;
  }
  std::string refusal(const std::string& text, const std::vector<std::string>& overrides = {}) {
    try {
      static_cast<void>(load_preset(write(text), kConfig / "models", overrides));
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  }

  test::TempFolder folder_;
};

TEST(ShippedPresets, LoadAndCarryTheirNumbers) {
  int seen = 0;
  for (const fs::directory_entry& entry : fs::directory_iterator(kConfig / "presets")) {
    if (entry.path().extension() != ".toml") continue;
    const Preset preset = load_preset(entry.path(), kConfig / "models");
    EXPECT_GT(preset.number, 0) << entry.path();
    EXPECT_NE(preset.fingerprint, 0);
    EXPECT_EQ(find_preset(kConfig / "presets", preset.number), entry.path());
    EXPECT_EQ(find_preset(kConfig / "presets", preset.name), entry.path());
    EXPECT_GT(Registrar::required_bytes(preset), 1000000U);
    ++seen;
  }
  EXPECT_GE(seen, 6);
}

TEST_F(PresetFile, EveryDefaultOfTheDescriptionIsAllowed) {
  const std::string text = describe_preset();
  const Preset preset = load_preset(write(text), kConfig / "models");
  EXPECT_EQ(preset.timeout_ms, 500);
  EXPECT_TRUE(preset.models.empty());
  for (const char* key : {"max_keypoints", "min_fitness", "method = \"iss\"", "draws", "views"}) {
    EXPECT_NE(text.find(key), std::string::npos) << key;
  }
}

TEST_F(PresetFile, MistakesNameFileLineKeyAndWhatIsAllowed) {
  const struct {
    const char* text;
    const char* expected;
  } cases[] = {
      {"max_objcts = 1\n", "max_objects"},
      {"[accept]\nmin_fitnes = 0.5\n", "min_fitness"},
      {"[accept]\nmin_fitness = 2.0\n", "21-test.toml:2: accept.min_fitness"},
      {"[accept]\nmin_fitness = \"high\"\n", "21-test.toml:2: accept.min_fitness"},
      {"[keypoints]\nmethod = \"sift4d\"\n", "iss"},
      {"[keypoints]\nmethod = \"sift4d\"\n", "21-test.toml:2: keypoints.method"},
      {"[keypoints]\nmethod = \"sift4d\"\n", "did you mean \"sift3d\"?"},
      {"[descriptors]\nmethod = \"fpf\"\n", "allowed: fpfh, pfh, spin_image"},
      {"[match]\nmetric = \"l2_square\"\n", "did you mean \"l2_squared\"?"},
      {"[[reject]]\nmethod = \"median\"\n[[reject]]\nmethod = \"ransca\"\n",
       "21-test.toml:4: reject.method"},
      {"[coarse]\nmethod = \"svg\"\n", "did you mean \"svd\"?"},
      {"[refine]\nmethod = \"gicp\"\n", "allowed: icp, generalized_icp, plain_icp"},
      {"[refine]\nmethod = \"plain_icp\"\nfreeze_ratio = 0.1\n", "refine.freeze_ratio"},
      {"[[refine]]\nmethod = \"icp\"\n[[refine]]\nmethod = \"icp\"\n", "one table is allowed"},
      {"[keypoints]\nmethod = \"iss\"\nradius = 3\n", "keypoints.radius"},
      {"[limits]\nmax_points = -1\n", "limits.max_points"},
      {"models = [\"nothing\"]\n", "nothing"},
      {"models = [\"box\", \"box\"]\n", "twice"},
      {"max_objects = 9\n", "max_objects"},
      {"[refine]\nmetric = \"plane\"\n", "point_to_plane"},
      {"[search]\nkept = 0\n", "search.kept"},
      {"timeout_ms = 500\ntimeout_ms = 600\n", "21-test.toml"},
      {"[accept\n", "21-test.toml:1"},
  };
  for (const auto& c : cases) {
    const std::string said = refusal(c.text);
    EXPECT_NE(said.find(c.expected), std::string::npos) << c.text << " -> " << said;
    EXPECT_NE(said.find("21-test.toml"), std::string::npos) << said;
  }
}

TEST_F(PresetFile, EveryMethodOfEveryStepIsChosenByNameWithEveryKeyOfItsDescription) {
  const std::string description = describe_preset();
  method_slots().each([&](const auto& slot) {
    const std::string table = slot.table;
    EXPECT_NE(description.find("[" + table + "]"), std::string::npos);
    for (const auto& method : slot.methods) {
      std::string text = "[" + table + "]\nmethod = \"" + std::string(method.name) + "\"\n";
      const ConfigTable over = slot_defaults(slot.defaults, method.name);
      for (std::size_t i = 0; i < method.fields().size(); ++i) {
        const std::string line =
            std::string(method.fields()[i].name) + " = " + method.default_text(i, over);
        EXPECT_NE(description.find(line), std::string::npos) << table << ": " << line;
        text += line + "\n";
      }
      EXPECT_EQ(refusal(text), "");
      EXPECT_EQ(refusal("", {table + ".method=" + std::string(method.name)}), "");
    }
  });
}

TEST_F(PresetFile, AMethodChosenOnTheCommandLineLeavesTheFilesKeysOfTheOldOne) {
  const std::string text = "[keypoints]\nmethod = \"uniform\"\ncell_ratio = 2.5\n";
  EXPECT_EQ(refusal(text, {"keypoints.method=sift3d"}), "");
  EXPECT_EQ(refusal(text, {"keypoints.method=uniform"}), "");
  EXPECT_NE(refusal(text, {"keypoints.method=sift3d", "keypoints.cell_ratio=2"}), "");
}

TEST_F(PresetFile, SeveralRejectorsAndGeneratorsFollowEachOther) {
  EXPECT_EQ(refusal("[[reject]]\nmethod = \"median\"\n[[reject]]\nmethod = \"graph\"\n"
                    "[[coarse]]\nmethod = \"surface_ransac\"\n[[coarse]]\nmethod = \"svd\"\n",
                    {"reject.3.method=one_to_one"}),
            "");
}

TEST_F(PresetFile, OverridesWinAndAreChecked) {
  const fs::path file = write("[accept]\nmin_fitness = 0.5\n");
  const Preset plain = load_preset(file, kConfig / "models");
  const Preset changed =
      load_preset(file, kConfig / "models", {"max_objects=3", "limits.max_keypoints=99"});
  EXPECT_EQ(changed.max_objects, 3);
  EXPECT_EQ(changed.limits.max_keypoints, 99U);
  EXPECT_NE(changed.fingerprint, plain.fingerprint);
  EXPECT_NE(refusal("", {"accept.min_fitness=7"}), "");
  EXPECT_NE(refusal("", {"accept.nonsense=7"}), "");
}

TEST_F(PresetFile, AMissingNumberListsWhatThereIs) {
  write("");
  write("", "22-other.toml");
  try {
    static_cast<void>(find_preset(folder_.path(), 99));
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("21-test, 22-other"), std::string::npos);
  }
  write("", "21-again.toml");
  EXPECT_THROW(static_cast<void>(find_preset(folder_.path(), 21)), InputError);
}

}  // namespace
}  // namespace grapnel
