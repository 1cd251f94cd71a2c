#include "drivers/synthetic/synthetic_camera.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include "drivers/synthetic/scene_renderer.h"
#include "hal/frame_pool.h"

namespace grapnel {
namespace {

namespace fs = std::filesystem;

constexpr int kFrames = 10;
// A thread that does not come to this in ten seconds never will.
constexpr std::int64_t kPatience_us = 10'000'000;

constexpr const char* kScene = R"(
[scene]
frames = 10
rate_hz = 25.0
[camera]
width = 80
height = 60
fx = 70.0
fy = 70.0
cx = 39.5
cy = 29.5
serial = "UNIT7"
[belt]
speed_m_s = 0.2
[[part]]
kind = "carton"
)";

class SyntheticCameraTest : public testing::Test {
 protected:
  void SetUp() override {
    const testing::TestInfo* info = testing::UnitTest::GetInstance()->current_test_info();
    folder_ = fs::path(testing::TempDir()) / (std::string("synthetic_") + info->name());
    fs::create_directories(folder_);
  }
  void TearDown() override {
    camera_.reset();
    fs::remove_all(folder_);
  }

  void make(const std::string& more_scene, const std::string& keys, const Clock* clock = nullptr) {
    std::ofstream(folder_ / "scene.toml") << kScene << more_scene;
    const std::string text = "driver = \"synthetic\"\nscene = \"scene.toml\"\n" + keys;
    camera_ = make_synthetic_camera(parse_config(text, (folder_ / "grapnel.toml").string()),
                                    clock != nullptr ? *clock : clock_);
  }

  /// Plays the scene to its end, as fast as it renders.
  void play(const std::string& more_scene) {
    make(more_scene, "mode = \"fast\"\nloop = false\n");
    ASSERT_TRUE(camera_->open().ok());
    ASSERT_TRUE(camera_->start(pool_, {}).ok());
    wait_for([this] { return camera_->status().state == CameraState::Ended; });
  }

  template <class Condition>
  void wait_for(Condition condition) {
    const MonotonicClock real_time;
    const std::int64_t limit_us = real_time.now_us() + kPatience_us;
    while (!condition() && real_time.now_us() < limit_us) {
      const std::uint32_t seen = pool_.published_signal().version();
      if (!condition()) pool_.published_signal().wait(seen, 5'000);
    }
    ASSERT_TRUE(condition());
  }

  /// All frames that the pool holds, oldest first.
  std::vector<FrameLease> frames() {
    std::vector<FrameLease> leases;
    std::int64_t since_us = 0;
    for (;;) {
      FrameLease lease = pool_.lease_first_since(since_us);
      if (!lease.valid()) return leases;
      since_us = lease.frame().exposure_us + 1;
      leases.push_back(std::move(lease));
    }
  }

  static std::vector<std::uint16_t> pixels(const FrameLease& lease) {
    const auto& depth = lease.frame().depth;
    return {depth.data, depth.data + depth.pixels()};
  }

  /// What frame `number` of the scene looks like without faults.
  std::vector<std::uint16_t> rendered(std::int64_t number) {
    const Scene scene = read_scene(parse_config(kScene, "scene.toml"), folder_);
    SceneRenderer renderer(scene);
    std::vector<std::uint16_t> depth(80 * 60);
    renderer.render(number, {depth.data(), 80, 60}, {});
    return depth;
  }

  fs::path folder_;
  MonotonicClock clock_;
  FramePool pool_{16, 80, 60, true};
  std::unique_ptr<Camera> camera_;
};

TEST_F(SyntheticCameraTest, PublishesTheScenesFramesInOrderAndEnds) {
  play("");
  const std::vector<FrameLease> leases = frames();
  ASSERT_EQ(leases.size(), static_cast<std::size_t>(kFrames));
  for (std::size_t i = 0; i < leases.size(); ++i) {
    EXPECT_EQ(leases[i].frame().sequence, i);
    EXPECT_EQ(leases[i].frame().device_us, static_cast<std::int64_t>(i) * 40'000);
    EXPECT_EQ(pixels(leases[i]), rendered(static_cast<std::int64_t>(i))) << i;
    EXPECT_FALSE(leases[i].frame().color.empty());
  }
  EXPECT_EQ(camera_->status().counters.frames, static_cast<std::uint64_t>(kFrames));
}

TEST_F(SyntheticCameraTest, TrueTimeSpacesExposuresByTheScenesRate) {
  ManualClock clock(1'000'000);
  make("", "loop = true\n", &clock);
  ASSERT_TRUE(camera_->open().ok());
  ASSERT_TRUE(camera_->start(pool_, {}).ok());
  for (std::uint64_t n = 1; n <= 3; ++n) {
    wait_for([this, n] { return pool_.published() == n; });
    clock.advance_us(40'000);
  }
  const std::vector<FrameLease> leases = frames();
  EXPECT_EQ(leases[0].frame().exposure_us, 1'000'000);
  EXPECT_EQ(leases[1].frame().exposure_us, 1'040'000);
  EXPECT_EQ(leases[2].frame().exposure_us, 1'080'000);
}

TEST_F(SyntheticCameraTest, LoopsWithoutEndAndRunsOnOverARestart) {
  make("", "mode = \"fast\"\n");
  ASSERT_TRUE(camera_->open().ok());
  ASSERT_TRUE(camera_->start(pool_, {}).ok());
  wait_for([this] { return pool_.published() > 2u * kFrames; });
  camera_->stop();
  const std::uint64_t last = frames().back().frame().sequence;
  ASSERT_TRUE(camera_->start(pool_, {}).ok());
  wait_for([this, last] { return pool_.lease_latest().frame().sequence > last; });
}

TEST_F(SyntheticCameraTest, ADropLeavesAGapInTheSequenceAndIsCounted) {
  play("[[fault]]\nkind = \"drop\"\nat_frame = 3\nframes = 2\n");
  const std::vector<FrameLease> leases = frames();
  ASSERT_EQ(leases.size(), 8u);
  EXPECT_EQ(leases[2].frame().sequence, 2u);
  EXPECT_EQ(leases[3].frame().sequence, 5u);
  EXPECT_EQ(camera_->status().counters.dropped, 2u);
}

TEST_F(SyntheticCameraTest, AStallLosesTimeButNoSequenceNumber) {
  play("[[fault]]\nkind = \"stall\"\nat_frame = 3\nframes = 4\n");
  const std::vector<FrameLease> leases = frames();
  ASSERT_EQ(leases.size(), 6u);
  EXPECT_EQ(leases[3].frame().sequence, 3u);
  EXPECT_EQ(leases[3].frame().device_us - leases[2].frame().device_us, 5 * 40'000);
  EXPECT_EQ(camera_->status().counters.dropped, 0u);
}

TEST_F(SyntheticCameraTest, ATornFrameKeepsTheLowerHalfOfTheOneBeforeAndCountsPackets) {
  play("[[fault]]\nkind = \"torn\"\nat_frame = 4\nframes = 1\n");
  const std::vector<FrameLease> leases = frames();
  std::vector<std::uint16_t> expected = rendered(4);
  const std::vector<std::uint16_t> before = rendered(3);
  std::copy(before.begin() + 80 * 30, before.end(), expected.begin() + 80 * 30);
  EXPECT_EQ(pixels(leases[4]), expected);
  EXPECT_EQ(leases[4].frame().lost_packets, kTornPackets);
  EXPECT_EQ(leases[5].frame().lost_packets, 0u);
  EXPECT_EQ(pixels(leases[5]), rendered(5));
  EXPECT_EQ(camera_->status().counters.lost_packets, kTornPackets);
}

TEST_F(SyntheticCameraTest, AnAllZeroFrameHasNoReading) {
  play("[[fault]]\nkind = \"all_zero\"\nat_frame = 2\n");
  const std::vector<FrameLease> leases = frames();
  EXPECT_EQ(pixels(leases[2]), std::vector<std::uint16_t>(80 * 60, 0));
  EXPECT_EQ(pixels(leases[3]), rendered(3));
}

TEST_F(SyntheticCameraTest, ADisconnectionWithoutEndLeavesTheCameraLost) {
  make("[[fault]]\nkind = \"disconnect\"\nat_frame = 3\nframes = 0\n", "mode = \"fast\"\n");
  ASSERT_TRUE(camera_->open().ok());
  ASSERT_TRUE(camera_->start(pool_, {}).ok());
  wait_for([this] { return camera_->status().state == CameraState::Lost; });
  EXPECT_EQ(camera_->status().code, Code::SensorNotConnected);
  EXPECT_EQ(camera_->status().counters.frames, 3u);
  EXPECT_FALSE(camera_->problem().empty());
}

TEST_F(SyntheticCameraTest, ComesBackAfterADisconnectionByItself) {
  play("[[fault]]\nkind = \"disconnect\"\nat_frame = 3\nframes = 4\n");
  EXPECT_EQ(camera_->status().counters.reconnects, 1u);
  EXPECT_EQ(camera_->status().counters.frames, 6u);
  const std::vector<FrameLease> leases = frames();
  ASSERT_EQ(leases.size(), 6u);
  EXPECT_EQ(pixels(leases[3]), rendered(7));
}

TEST_F(SyntheticCameraTest, AnotherUnitAfterADisconnectionIsAWrongSerial) {
  make("[[fault]]\nkind = \"wrong_serial\"\nat_frame = 1\nframes = 0\n", "mode = \"fast\"\n");
  ASSERT_TRUE(camera_->open().ok());
  ASSERT_TRUE(camera_->start(pool_, {}).ok());
  wait_for([this] { return camera_->status().code == Code::WrongSerial; });
  EXPECT_EQ(camera_->status().state, CameraState::Lost);
}

TEST_F(SyntheticCameraTest, DeviceTimeRunsOnWhenThe32BitClockWraps) {
  play("[[fault]]\nkind = \"clock_wrap\"\nat_frame = 5\n");
  const std::vector<FrameLease> leases = frames();
  ASSERT_EQ(leases.size(), static_cast<std::size_t>(kFrames));
  // 2^32 ticks of 60 MHz are 71.58 s; five frames before that the stream begins.
  EXPECT_EQ(leases[0].frame().device_us, ((std::int64_t{1} << 32) - 5 * 40'000 * 60) / 60);
  for (std::size_t i = 1; i < leases.size(); ++i) {
    EXPECT_EQ(leases[i].frame().device_us - leases[i - 1].frame().device_us, 40'000) << i;
  }
}

TEST_F(SyntheticCameraTest, RefusesAnotherSerialAndAMissingScene) {
  make("", "serial = \"UNIT8\"\n");
  const auto wrong = camera_->open();
  ASSERT_FALSE(wrong.ok());
  EXPECT_EQ(wrong.error().code, Code::WrongSerial);
  EXPECT_NE(camera_->problem().find("UNIT8"), std::string::npos);
  fs::remove(folder_ / "scene.toml");
  EXPECT_FALSE(camera_->open().ok());
  EXPECT_NE(camera_->problem().find("scene.toml"), std::string::npos);
}

TEST(TickUnwrapper, GivesTheElapsedTimeOverAnyNumberOfWraps) {
  TickUnwrapper clock;
  const std::int64_t first_us = clock.time_us(4'000'000'000u);
  std::uint32_t ticks = 4'000'000'000u;
  for (std::int64_t step = 1; step <= 20; ++step) {
    ticks += 3'000'000'000u;  // 50 s
    EXPECT_EQ(clock.time_us(ticks) - first_us, step * 50'000'000) << step;
  }
}

}  // namespace
}  // namespace grapnel
