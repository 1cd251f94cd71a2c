#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "base/config.h"
#include "drivers/replay/recording.h"
#include "drivers/synthetic/scene.h"
#include "workbench/commands.h"
#include "workbench/simulate/scene_help.h"
#include "workbench/simulate/simulated_recording.h"

namespace grapnel {
namespace {

namespace fs = std::filesystem;

constexpr const char* kScene = R"(
[scene]
frames = 6
[camera]
width = 160
height = 120
fx = 140.0
fy = 140.0
cx = 79.5
cy = 59.5
[belt]
pitch_m = 1.5
dwell_frames = 2
move_frames = 1
stations = 2
[[part]]
name = "left"
model = "box"
station = 0
[[part]]
name = "right"
kind = "sack"
model = "sack"
station = 1
x_m = 0.1
[[event]]
station = 1
kind = "sack"
model = "sack"
part = "right"
[[event]]
station = 0
kind = "box"
model = "box"
part = "left"
)";

class Simulate : public testing::Test {
 protected:
  void SetUp() override {
    const testing::TestInfo* info = testing::UnitTest::GetInstance()->current_test_info();
    folder_ = fs::path(testing::TempDir()) / (std::string("simulate_") + info->name());
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    scene_file_ = folder_ / "scene.toml";
    std::ofstream(scene_file_) << kScene;
  }
  void TearDown() override { fs::remove_all(folder_); }

  int run(const std::vector<std::string>& more, const std::string& output) {
    std::vector<std::string> args = {"simulate", scene_file_.string(), "-o",
                                     (folder_ / output).string()};
    args.insert(args.end(), more.begin(), more.end());
    return run_grapnel(args);
  }

  [[nodiscard]] std::map<std::string, std::string> files(const std::string& output) const {
    std::map<std::string, std::string> contents;
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder_ / output)) {
      if (!entry.is_regular_file()) continue;
      std::ifstream stream(entry.path(), std::ios::binary);
      contents[fs::relative(entry.path(), folder_ / output).string()] =
          std::string(std::istreambuf_iterator<char>(stream), {});
    }
    return contents;
  }

  [[nodiscard]] std::vector<nlohmann::json> lines(const std::string& file) const {
    std::vector<nlohmann::json> parsed;
    std::ifstream stream(folder_ / file);
    for (std::string line; std::getline(stream, line);)
      parsed.push_back(nlohmann::json::parse(line));
    return parsed;
  }

  fs::path folder_;
  fs::path scene_file_;
};

TEST_F(Simulate, RefusesASetThatIsToldOfAScenesKeys) {
  for (const std::vector<std::string>& more : {std::vector<std::string>{"--set", "belt.length_m=1"},
                                               std::vector<std::string>{"--frames", "3"}}) {
    std::vector<std::string> args = {"simulate", "--set-of", "sack", "-o",
                                     (folder_ / "set").string()};
    args.insert(args.end(), more.begin(), more.end());
    testing::internal::CaptureStderr();
    EXPECT_EQ(run_grapnel(args), 2);
    EXPECT_NE(testing::internal::GetCapturedStderr().find(more[0] + " " + more[1] + ": "),
              std::string::npos);
    EXPECT_FALSE(fs::exists(folder_ / "set"));
  }
}

TEST_F(Simulate, WritesTheSameBytesForTheSameSeedAndOthersForAnother) {
  ASSERT_EQ(run({}, "a"), 0);
  ASSERT_EQ(run({}, "b"), 0);
  ASSERT_EQ(run({"--seed", "9"}, "c"), 0);
  EXPECT_EQ(files("a"), files("b"));
  EXPECT_NE(files("a").at("depth/0.000000.png"), files("c").at("depth/0.000000.png"));
}

TEST_F(Simulate, WritesARecordingWithAPoseAndTheObjectsOfEveryFrame) {
  ASSERT_EQ(run({}, "a"), 0);
  const Recording recording = Recording::open(folder_ / "a");
  EXPECT_EQ(recording.frame_count(), 6u);
  EXPECT_TRUE(recording.has_color());
  EXPECT_EQ(recording.time_us(3), 100'000);
  const std::vector<TimedPose> poses = recording.ground_truth();
  ASSERT_EQ(poses.size(), 6u);
  EXPECT_NEAR(poses[5].pose.translation().z(), 1.1, 1e-9);
  const std::vector<nlohmann::json> objects = lines("a/objects.jsonl");
  ASSERT_EQ(objects.size(), 6u);
  ASSERT_EQ(objects[0]["objects"].size(), 1u);
  EXPECT_EQ(objects[0]["objects"][0]["model"], "box");
  EXPECT_EQ(objects[3]["objects"][0]["name"], "right");
}

TEST_F(Simulate, TruthIsTheCamerasViewOfThePartsPlaceOnTheBelt) {
  ASSERT_EQ(run({}, "a"), 0);
  // The box of 0.2 m under a camera at 1.1 m: its centre 1.0 m below, y and z turned round.
  const std::vector<double> expected = {1, 0, 0, 0, 0, -1, 0, 0, 0, 0, -1, 1.0, 0, 0, 0, 1};
  const auto truth = lines("a/objects.jsonl")[0]["objects"][0]["camera_from_model"];
  for (std::size_t i = 0; i < 16; ++i) EXPECT_NEAR(truth[i].get<double>(), expected[i], 1e-12);
}

TEST_F(Simulate, EventsFollowTheBeltAndCarryTheTruthAtTheirTrigger) {
  ASSERT_EQ(run({}, "a"), 0);
  const std::vector<nlohmann::json> events = lines("a/events.jsonl");
  const std::vector<nlohmann::json> objects = lines("a/objects.jsonl");
  ASSERT_EQ(events.size(), 2u);
  EXPECT_EQ(events[0]["model"], "box");
  EXPECT_EQ(events[1]["model"], "sack");
  EXPECT_EQ(events[1]["first_frame"], 3);
  EXPECT_EQ(events[1]["last_frame"], 4);
  for (const nlohmann::json& event : events) {
    const auto frame = event["trigger_frame"].get<std::size_t>();
    EXPECT_EQ(event["camera_from_model"], objects[frame]["objects"][0]["camera_from_model"]);
  }
}

TEST_F(Simulate, FaultsTakeFramesOutOfTheRecordingButNotOutOfTheTruth) {
  std::ofstream(scene_file_, std::ios::app)
      << "[[fault]]\nkind = \"drop\"\nat_frame = 2\nframes = 2\n"
         "[[fault]]\nkind = \"all_zero\"\nat_frame = 5\n";
  ASSERT_EQ(run({}, "a"), 0);
  const Recording recording = Recording::open(folder_ / "a");
  ASSERT_EQ(recording.frame_count(), 4u);
  EXPECT_EQ(recording.time_us(2), 133'333);
  EXPECT_EQ(lines("a/objects.jsonl").size(), 6u);
  std::vector<std::uint16_t> depth(160 * 120);
  recording.read_frame(3, depth, {});
  EXPECT_EQ(std::count(depth.begin(), depth.end(), 0), 160 * 120);
}

TEST_F(Simulate, RefusesAFolderThatHoldsARecordingAndABadSeed) {
  ASSERT_EQ(run({"--frames", "1"}, "a"), 0);
  EXPECT_EQ(run({"--frames", "1"}, "a"), 2);
  EXPECT_EQ(run({"--seed", "many"}, "b"), 2);
}

TEST(SceneHelp, NamesEveryKeyWithUnitRangeAndDefault) {
  const std::string help = scene_help();
  EXPECT_NE(help.find("[camera]"), std::string::npos);
  EXPECT_NE(help.find("height_m = 1.1 (m, 0.1 to 10): height above the belt"), std::string::npos);
  EXPECT_NE(help.find("kind = \"box\" (box | carton | barrel | sack | mesh): its shape"),
            std::string::npos);
}

TEST(DemoScene, HasTwelveEventsInAtMostTwentySeconds) {
  const Scene scene = load_scene(fs::path(GRAPNEL_SOURCE_DIR) / "config/scenes/demo.toml");
  EXPECT_LE(static_cast<double>(scene.frames) / scene.rate_hz, 20.0);
  EXPECT_EQ(scene.frames, std::int64_t{scene.belt.stations} * scene.belt.period_frames());
  std::map<Expectation, int> expected;
  std::map<std::string, int> models;
  for (const SceneEvent& event : scene.events) {
    ++expected[event.expected];
    if (event.expected == Expectation::Accept) ++models[event.model];
  }
  EXPECT_GE(expected[Expectation::Accept], 5);
  EXPECT_EQ(expected[Expectation::Empty], 1);
  EXPECT_EQ(expected[Expectation::Wrong], 1);
  EXPECT_GE(models.size(), 3u);
}

}  // namespace
}  // namespace grapnel
