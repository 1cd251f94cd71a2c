#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <string>
#include <vector>

#include "tests/system/daemon_process.h"

namespace grapnel::test {
namespace {

namespace fs = std::filesystem;

constexpr int kConfigRefusals = 17;

/// A broken file and what its refusal must say.
struct Broken {
  const char* file;
  std::string text;
  std::vector<std::string> says;
  Code code = Code::PresetInvalid;
};

std::string with(const std::string& from, const std::string& to) {
  std::string text = Site::config_text(10);
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

const char* const kConfig = "grapnel.toml";
const char* const kPreset = "presets/10-sack.toml";

/// The presets come first: each is mended before the next, while a broken grapnel.toml may be
/// followed by another.
std::vector<Broken> broken_files() {
  const std::string good = Site::config_text(10);
  return {
      {kPreset, "models = [\"sock\"]\n", {"10-sack.toml:1: models: \"sock\": no file"}},
      {kPreset, "models = [\"sack\", \"sack\"]\n", {"10-sack.toml:1: models", "listed twice"}},
      {kPreset,
       "models = [\"sack\"]\ntimeout_ms = 5\n",
       {"10-sack.toml:2: timeout_ms: 5 is out of range; 10 to 60000 ms"}},
      {kPreset,
       "models = [\"sack\"]\npose_format = 8\n",
       {"10-sack.toml:2: pose_format: 8 is out of range; 1 to 7"}},
      {kPreset,
       "models = [\"sack\"]\n[limits]\nmax_points = 1e12\n",
       {"10-sack.toml:3: limits.max_points"}},
      {kPreset,
       "models = [\"sack\"]\n[limits]\nmax_width = 1280\nmax_height = 1024\nmax_points = 200000\n",
       {"10-sack.toml: needs ", "the budget of one preset is 67108864"},
       Code::OverMemoryBudget},
      {kPreset,
       "models = [\"sack\"]\n[keypoints]\nmethod = \"isis\"\n",
       {"10-sack.toml:3: keypoints.method: method \"isis\" is unknown; allowed: iss"}},
      {kPreset, "models = [\"sack\"]\nmodel = 3\n", {"10-sack.toml:2: model: 3 is not allowed"}},
      {kConfig,
       with("auto_arm", "autoarm"),
       {"grapnel.toml:2", "autoarm", "unknown key", "auto_arm"}},
      {kConfig,
       with("= true", "= 1"),
       {"grapnel.toml:2: auto_arm: 1 is not allowed; true or false"}},
      {kConfig,
       with("= 10", "= 0"),
       {"grapnel.toml:1: active_preset: 0 is out of range; 1 to 999"}},
      {kConfig, with("= 10", "= 1000"), {"grapnel.toml:1: active_preset: 1000", "1 to 999"}},
      {kConfig, with("= 10", "= 10.5"), {"grapnel.toml:1: active_preset: 10.5", "whole number"}},
      {kConfig, with("= 10", "= \"10\""), {"grapnel.toml:1: active_preset: \"10\"", "1 to 999"}},
      {kConfig, with("= 10", "= 77"), {"no preset 77", "10-sack"}, Code::PresetMissing},
      {kConfig, with("= 10", "="), {"grapnel.toml:1", "not valid TOML"}},
      {kConfig,
       with("auto_arm = true", "active_preset = 11"),
       {"grapnel.toml:2", "not valid TOML"}},
      {kConfig, with("[camera]", "[camera"), {"grapnel.toml:3", "not valid TOML"}},
      {kConfig, with("[camera]", "[kamera]"), {"camera"}},
      {kConfig, with("driver = \"synthetic\"\n", ""), {"driver"}},
      {kConfig, with("[belt]", "[bolt]"), {"grapnel.toml:12", "bolt", "unknown key", "belt"}},
      {kConfig,
       with("exposure_us = 30000", "exposure_us = -1"),
       {"grapnel.toml:11: capture.exposure_us: -1 is out of range; 0 to 1000000 us"}},
      {kConfig,
       with("exposure_us = 30000", "frame_choice = \"newest\""),
       {"grapnel.toml:11: capture.frame_choice: \"newest\"", "\"first_after\", \"nearest\""}},
      {kConfig,
       with("0.0, 0.0, -1.0, 1.1", "0.0, 0.0, -1.0"),
       {"grapnel.toml:13: belt.plane: a list of 3 numbers", "4 are"}},
      {kConfig,
       with("0.0, 0.0, -1.0, 1.1", "0.0, 0.0, \"down\", 1.1"),
       {"grapnel.toml:13: belt.plane: \"down\""}},
      {kConfig,
       with("port = 0", "port = 70000"),
       {"grapnel.toml:15: fieldbus.port: 70000 is out of range", "65535"}},
      {kConfig,
       with("port = 0", "word_order = \"DCBA\""),
       {"grapnel.toml:15: fieldbus.word_order: \"DCBA\"", "ABCD"}},
      {kConfig, with("port = 0", "port = 0\nport = 1"), {"grapnel.toml:16", "not valid TOML"}},
      {kConfig,
       with("budget_mb = 128", "budget_mb = 0"),
       {"grapnel.toml:17: memory.budget_mb: 0 is out of range; 1 to 65536 MiB"}},
      {kConfig,
       good + "[calibration]\nrobot_from_camera = [1, 0, 0]\n",
       {"grapnel.toml:19: calibration.robot_from_camera: a list of 3 numbers", "16 are"}},
      {kConfig,
       good + "[calibration]\nrobot_from_camera = [2,0,0,0, 0,2,0,0, 0,0,2,0, 0,0,0,1]\n",
       {"grapnel.toml:19: calibration.robot_from_camera: not a rigid motion"}},
      {kConfig,
       good + "[realtime]\nregistration_priority = 99\n",
       {"grapnel.toml:19: realtime.registration_priority: 99 is out of range; 0 to 90"}},
      {kConfig,
       good + "[roi]\noverrides = [\"no_such_key=1\"]\n",
       {"grapnel.toml:19: roi.overrides: no_such_key: unknown key"}},
      {kConfig, good.substr(0, good.size() / 2), {"grapnel.toml"}},
      {kConfig, std::string((1U << 20) + 1U, '#'), {"1048577 bytes", "1048576"}},
      {kConfig, std::string("active_preset = 10\0\1\2", 21), {"grapnel.toml:1", "not valid TOML"}},
      {kConfig, "", {"grapnel.toml", "active_preset"}},
  };
}

TEST(BrokenConfig, EachIsRefusedWithItsPlaceWhileTheOldOneRuns) {
  const Site site;
  const std::string good_preset = site.read(kPreset);
  DaemonProcess daemon(site);
  ASSERT_TRUE(daemon.wait_ready());
  Plc plc(daemon.port());
  const std::uint16_t revision = plc.status().preset_rev;
  const std::vector<Broken> files = broken_files();
  ASSERT_GE(files.size(), 25U);
  for (const Broken& broken : files) {
    SCOPED_TRACE(std::string(broken.file) + ":\n" + broken.text.substr(0, 400));
    const std::uint32_t refusals = plc.diagnostic(kConfigRefusals);
    const std::size_t log_before = daemon.log().size();
    site.write(broken.file, broken.text);
    ASSERT_TRUE(eventually([&] { return plc.diagnostic(kConfigRefusals) > refusals; }))
        << daemon.log().substr(log_before);
    const std::string said = daemon.log().substr(log_before);
    for (const std::string& part : broken.says) {
      EXPECT_NE(said.find(part), std::string::npos) << "\"" << part << "\" is missing in: " << said;
    }
    const PlcStatus status = plc.status();
    EXPECT_EQ(status.status_code, broken.code);
    EXPECT_EQ(status.active_preset, 10);
    EXPECT_EQ(status.preset_rev, revision);
    EXPECT_NE(status.flags & kFlagReduced, 0);
    EXPECT_NE(status.flags & kFlagReady, 0);
    if (broken.file == kPreset) site.write(kPreset, good_preset);
  }
  site.write(kConfig, Site::config_text(10));
  ASSERT_TRUE(eventually([&] { return plc.status().status_code == Code::Ready; }));
  EXPECT_EQ(plc.send(PlcCommandCode::Register, {.timeout_ms = 10'000}).reading.result.code,
            Code::ObjectFound);
}

TEST(BrokenConfig, StopsAStartWithOneLine) {
  for (const Broken& broken : broken_files()) {
    const Site site;
    site.write(broken.file, broken.text);
    SCOPED_TRACE(std::string(broken.file) + ":\n" + broken.text.substr(0, 400));
    const Finished check = run_grapneld({"--check", "--config", site.config().string()});
    EXPECT_EQ(check.status, 1);
    for (const std::string& part : broken.says) {
      EXPECT_NE(check.err.find(part), std::string::npos) << "said: " << check.err;
    }
    EXPECT_EQ(std::count(check.err.begin(), check.err.end(), '\n'), 1) << check.err;
  }
}

TEST(BrokenConfig, StartsReducedOnTheLastGoodOneOrNotAtAll) {
  const Site site;
  {
    DaemonProcess daemon(site);
    ASSERT_TRUE(daemon.wait_ready());
    Plc plc(daemon.port());
    for (int i = 0; i < 3; ++i) plc.send(PlcCommandCode::Register, {.timeout_ms = 10'000});
    ASSERT_TRUE(eventually([&] { return fs::exists(site.folder() / "state" / "last_good.toml"); }));
  }
  site.write(kConfig, "active_preset = \n");
  {
    DaemonProcess daemon(site);
    ASSERT_TRUE(daemon.wait_ready());
    Plc plc(daemon.port());
    const PlcStatus status = plc.status();
    EXPECT_EQ(status.active_preset, 10);
    EXPECT_EQ(status.status_code, Code::RolledBack);
    EXPECT_NE(status.flags & kFlagReduced, 0);
    EXPECT_NE(status.flags & kFlagReady, 0);
  }
  fs::remove(site.folder() / "state" / "last_good.toml");
  const Finished start = run_grapneld({"--config", site.config().string()});
  EXPECT_EQ(start.status, 2);
  EXPECT_NE(start.err.find("grapnel.toml:1"), std::string::npos) << start.err;
}

TEST(CommandLine, ChecksAndPrintsThePlanByPart) {
  const Site site;
  const Finished check = run_grapneld({"--check", "--config", site.config().string()});
  EXPECT_EQ(check.status, 0) << check.err;
  EXPECT_EQ(check.err, "");
  for (const char* part : {"preset 10 sack", "sum", "of 67108864", "block of two presets",
                           "134217728", "frame pool", "taught background", "all is well"}) {
    EXPECT_NE(check.out.find(part), std::string::npos) << part << "\n" << check.out;
  }
}

TEST(CommandLine, RefusesAPresetOverBudgetWithBothNumbers) {
  const Site site;
  const Finished check =
      run_grapneld({"--check", "--config", site.config().string(), "--set", "memory.budget_mb=1"});
  EXPECT_EQ(check.status, 1);
  EXPECT_NE(check.err.find("the budget of one preset is 524288"), std::string::npos) << check.err;
  const Finished start =
      run_grapneld({"--config", site.config().string(), "--set", "memory.budget_mb=1"});
  EXPECT_EQ(start.status, 2);
  EXPECT_NE(start.err.find("the budget of one preset is 524288"), std::string::npos) << start.err;
}

TEST(CommandLine, AnswersWrongUsageWithTwo) {
  const Site site;
  EXPECT_EQ(run_grapneld({"--confg", "x"}).status, 2);
  EXPECT_EQ(run_grapneld({"--config"}).status, 2);
  EXPECT_EQ(run_grapneld({"--config", "/no/such/file"}).status, 2);
  EXPECT_EQ(run_grapneld({"--check", "--config", "/no/such/file"}).status, 2);
  EXPECT_EQ(run_grapneld({"--config", site.config().string(), "--simd", "MMX"}).status, 2);
}

TEST(CommandLine, TellsAboutItself) {
  const Finished help = run_grapneld({"--help"});
  EXPECT_EQ(help.status, 0);
  EXPECT_NE(help.out.find("--config FILE"), std::string::npos);
  const Finished version = run_grapneld({"--version"});
  EXPECT_EQ(version.status, 0);
  EXPECT_EQ(version.out.rfind("grapneld ", 0), 0U);
  const Finished cameras = run_grapneld({"--list-cameras"});
  EXPECT_EQ(cameras.status, 0);
  EXPECT_NE(cameras.out.find("replay"), std::string::npos);
}

TEST(ShippedConfig, PassesItsOwnCheck) {
  const Finished check = run_grapneld(
      {"--check", "--config", std::string(GRAPNEL_SOURCE_DIR) + "/config/grapnel.toml"});
  EXPECT_EQ(check.status, 0) << check.err;
}

}  // namespace
}  // namespace grapnel::test
