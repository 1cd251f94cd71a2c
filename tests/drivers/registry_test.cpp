#include "drivers/registry.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "base/config_text.h"
#include "base/file.h"
#include "hal/camera_plugin.h"
#include "tests/support/small_recording.h"
#include "tests/support/temp_folder.h"

namespace grapnel {
namespace {

const std::string kPlugins = GRAPNEL_BINARY_DIR "/tests/plugins";

std::string message_of(const std::string& text) {
  const MonotonicClock clock;
  try {
    (void)make_camera(parse_config(text, "g.toml"), clock);
  } catch (const InputError& error) {
    return error.what();
  }
  return "accepted";
}

std::string with_plugins(const std::string& driver) {
  return "driver = \"" + driver + "\"\nplugins = \"" + kPlugins + "\"\npath = \"x\"\n";
}

TEST(Registry, MakesABuiltInDriverByItsName) {
  const MonotonicClock clock;
  const auto camera = make_camera(parse_config("driver = \"replay\"\npath = \"x\"", "g"), clock);
  ASSERT_NE(camera, nullptr);
  EXPECT_FALSE(camera->open().ok());
  EXPECT_NE(camera->problem(), "");
}

TEST(Registry, NamesWhatIsAllowedForAnUnknownDriver) {
  EXPECT_NE(message_of("driver = \"repaly\"").find("did you mean \"replay\"?"), std::string::npos);
  EXPECT_EQ(message_of("driver = \"repaly\"").find("g.toml:1: driver: \"repaly\" is not allowed; "),
            0u);
  EXPECT_NE(message_of("driver = \"../x\"").find("is not allowed"), std::string::npos);
  EXPECT_EQ(message_of("path = \"x\""), "g.toml:1: key \"driver\" is missing");
}

TEST(Registry, RunsACameraOutOfAPlugIn) {
  const test::TempFolder folder;
  test::write_small_recording(folder / "r", 2, false);
  const MonotonicClock clock;
  const ConfigTable table =
      parse_config("driver = \"test\"\nplugins = \"" + kPlugins + "\"\nmode = \"fast\"\npath = \"" +
                       (folder / "r").string() + "\"\n",
                   "g.toml");
  const auto camera = make_camera(table, clock);
  ASSERT_TRUE(camera->open().ok()) << camera->problem();
  FramePool pool(3, test::kSmallWidth, test::kSmallHeight, false);
  ASSERT_TRUE(camera->start(pool, {}).ok());
  for (int look = 0; look < 1000 && pool.published() < 2; ++look) {
    pool.published_signal().wait(pool.published_signal().version(), 5'000);
  }
  EXPECT_EQ(pool.published(), 2u);
}

TEST(Registry, RefusesAPlugInWithAnotherInterfaceVersion) {
  // The plug-in claims the next version.
  const std::string versions = "was built for camera interface " +
                               std::to_string(kGrapnelCameraAbi + 1) + "; this program has " +
                               std::to_string(kGrapnelCameraAbi);
  EXPECT_NE(message_of(with_plugins("old")).find(versions), std::string::npos)
      << message_of(with_plugins("old"));
}

TEST(Registry, RefusesWhatIsNoPlugInOrAnotherOne) {
  EXPECT_NE(message_of(with_plugins("none")).find("exports no grapnel_camera_plugin"),
            std::string::npos);
  EXPECT_NE(message_of(with_plugins("renamed")).find("is not the plug-in of driver \"renamed\""),
            std::string::npos);
  const test::TempFolder folder;
  write_file(folder / "libgrapnel_camera_text.so", std::string_view("no library"));
  EXPECT_NE(message_of("driver = \"text\"\nplugins = \"" + folder.path().string() + "\"")
                .find("can't be loaded"),
            std::string::npos);
}

TEST(Registry, PassesOnWhatThePlugInComplainsOf) {
  const std::string text = with_plugins("test") + "speed = 3\n";
  EXPECT_TRUE(message_of(text).starts_with("g.toml:4: speed: unknown key")) << message_of(text);
}

TEST(ConfigText, ReadsBackAsTheSameKeysAndValues) {
  const std::string text =
      "a = true\nb = -3\nc = 2.0\nd = \"x \\\" \\\\ \\n \xc3\xa4\"\ne = [1, 2.5, \"z\"]\n"
      "f = {g = 1, h = {i = 1e30}}\n[[j]]\nk = 1\n[[j]]\nk = 2\n";
  const std::string once = config_text(parse_config(text, "a"));
  EXPECT_EQ(config_text(parse_config(once, "b")), once);
  const ConfigTable table = parse_config(once, "b");
  EXPECT_EQ(std::get<std::string>(table.find("d")->data), "x \" \\ \n \xc3\xa4");
  EXPECT_EQ(std::get<double>(table.find("c")->data), 2.0);
  EXPECT_EQ(std::get<std::vector<ConfigTable>>(table.find("j")->data).size(), 2u);
}

}  // namespace
}  // namespace grapnel
