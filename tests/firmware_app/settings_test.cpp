#include "firmware_app/settings.h"

#include <gtest/gtest.h>

#include "base/input_error.h"

namespace grapnel {
namespace {

constexpr const char* kLeast = "active_preset = 3\n[camera]\ndriver = \"replay\"\n";

Settings read(const std::string& text) {
  return read_settings(parse_config(text, "g.toml"), "g.toml", "/etc/grapnel");
}

/// The line that a broken text is refused with; "" when it is taken.
std::string refusal(const std::string& text) {
  try {
    (void)read(text);
  } catch (const InputError& problem) {
    return problem.what();
  }
  return "";
}

TEST(Settings, TakeDefaultsForWhatIsAbsent) {
  const Settings settings = read(kLeast);
  EXPECT_EQ(settings.general.active_preset, 3);
  EXPECT_FALSE(settings.general.auto_arm);
  EXPECT_EQ(settings.presets_folder(), "/etc/grapnel/presets");
  EXPECT_EQ(settings.fieldbus.port, 502);
  EXPECT_FALSE(settings.calibrated());
  EXPECT_EQ(settings.preset_budget_bytes(), std::size_t{256} << 20);
}

TEST(Settings, ReadCalibrationRowByRow) {
  const Settings settings = read(std::string(kLeast) +
                                 "[calibration]\nrobot_from_camera = [0, -1, 0, 0.5,  1, 0, 0, "
                                 "-2,  0, 0, 1, 3,  0, 0, 0, 1]\n");
  ASSERT_TRUE(settings.calibrated());
  const Vec3d moved = settings.robot_from_camera() * Vec3d(1.0, 2.0, 3.0);
  EXPECT_TRUE(moved.isApprox(Vec3d(-1.5, -1.0, 6.0)));
}

TEST(Settings, RefuseInOneLineThatNamesFileLineKeyValueAndRange) {
  const struct {
    const char* text;
    const char* line;
  } cases[] = {
      {"[camera]\ndriver = \"replay\"\n", "active_preset"},
      {"active_preset = 3\n", "camera"},
      {"active_preset = 3\n[camera]\nfolder = \"x\"\n", "driver"},
      {"active_preset = 0\n[camera]\ndriver = \"replay\"\n",
       "g.toml:1: active_preset: 0 is out of range; 1 to 999 is allowed"},
      {"active_preset = \"3\"\n[camera]\ndriver = \"replay\"\n",
       "g.toml:1: active_preset: \"3\" is not allowed; a whole number from 1 to 999 is"},
      {"active_preset = 3\nautoarm = true\n[camera]\ndriver = \"replay\"\n",
       "g.toml:2: autoarm: unknown key; did you mean \"auto_arm\"?"},
      {"active_preset = 3\nactive_preset = 4\n[camera]\ndriver = \"replay\"\n", "g.toml:2"},
      {"active_preset = 3\n[camera]\ndriver = \"replay\"\n[realtime]\ncapture_priority = 99\n",
       "g.toml:5: realtime.capture_priority: 99 is out of range; 0 to 90 is allowed"},
      {"active_preset = 3\n[camera]\ndriver = \"replay\"\n[capture]\nframe_choice = \"last\"\n",
       "g.toml:5: capture.frame_choice: \"last\" is not allowed; one of \"first_after\", "
       "\"nearest\" is"},
      {"active_preset = 3\n[camera]\ndriver = \"replay\"\n[calibration]\nrobot_from_camera = [1]\n",
       "g.toml:5: calibration.robot_from_camera: a list of 1 numbers is not allowed; 16 are"},
      {"active_preset = 3\n[camera]\ndriver = \"replay\"\n[calibration]\nrobot_from_camera = "
       "[2,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1]\n",
       "g.toml:5: calibration.robot_from_camera: not a rigid motion"},
      {"active_preset = 3\n[camera]\ndriver = \"replay\"\n[belt]\nplane = [0, 0, 2, 1]\n",
       "g.toml:5: belt.plane: its normal has length"},
      {"active_preset = 3\n[camera]\ndriver = \"replay\"\n[fieldbus]\nport = 70000\n",
       "g.toml:5: fieldbus.port: 70000 is out of range"},
      {"active_preset = 3\n[camera\n", "g.toml:2: not valid TOML"},
  };
  for (const auto& [text, line] : cases) {
    const std::string said = refusal(text);
    EXPECT_NE(said.find(line), std::string::npos) << text << "said: " << said;
    EXPECT_EQ(said.find('\n'), std::string::npos);
  }
}

TEST(Settings, NameWhatNeedsARestart) {
  const Settings running = read(kLeast);
  EXPECT_EQ(needs_restart(running, read(kLeast)), "");
  EXPECT_EQ(needs_restart(running, read("active_preset = 4\n[camera]\ndriver = \"replay\"\n")), "");
  EXPECT_EQ(needs_restart(running, read("active_preset = 3\n[camera]\ndriver = \"synthetic\"\n")),
            "[camera]");
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"[fieldbus]\nport = 1502\n", "[fieldbus]"},
      {"[memory]\nbudget_mb = 64\n", "[memory]"},
      {"[belt]\nlearn_frames = 3\n", "[belt]"},
      {"[calibration]\nserial = \"A7\"\n", "calibration.serial"},
      {"[belt]\nlearn_frames = 3\n[realtime]\nlock_memory = false\n", "[belt], [realtime]"},
      // Taken over with the preset.
      {"[roi]\nmax_occupied_share = 0.5\n", ""},
  };
  for (const auto& [text, names] : cases) {
    EXPECT_EQ(needs_restart(running, read(kLeast + text)), names) << text;
  }
  EXPECT_EQ(needs_restart(running, read(std::string("auto_arm = true\n") + kLeast)), "auto_arm");
}

TEST(Settings, DescribeEveryKeyOnce) {
  for (const SettingsSection& section : settings_sections()) {
    for (const Field& field : section.fields) {
      EXPECT_FALSE(field.help.empty()) << section.name << "." << field.name;
      int same = 0;
      for (const Field& other : section.fields) same += other.name == field.name ? 1 : 0;
      EXPECT_EQ(same, 1) << field.name;
    }
  }
}

}  // namespace
}  // namespace grapnel
