// The driver of OpenNI's cameras with Debian's OpenNI 2, over a driver of our own inside it.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <regex>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "base/clock.h"
#include "base/config.h"
#include "drivers/registry.h"
#include "tests/support/fake_openni/sensor_file.h"

namespace grapnel::test {
namespace {

constexpr std::size_t kPixels = std::size_t{kSensorWidth} * kSensorHeight;
const std::string kPlugins = GRAPNEL_BINARY_DIR "/bin/cameras";

class OpenNi : public testing::Test {
 protected:
  void SetUp() override {
    sensor_.color = 1;
    sensor_.registers = 1;
    sensor_.speed_up = 1;
    sensor_.color_skew_us = 400;
    sensor_.says_goodbye = 1;
    for (auto* fault :
         {&sensor_.color_frozen, &sensor_.silent, &sensor_.skip_frames, &sensor_.stuck_mirror,
          &sensor_.hang_open, &sensor_.hang_start, &sensor_.hang_stop, &sensor_.no_cropping}) {
      *fault = 0;
    }
    set_serial("1206090012");
    plug_in(sensor_);
  }
  void TearDown() override {
    camera_.reset();
    EXPECT_TRUE(wait([&] { return sensor_.streams == 0 && sensor_.opened == 0; }, 3.0))
        << sensor_.streams << " streams, " << sensor_.opened << " devices left open";
    EXPECT_EQ(sensor_.running, 0);
  }

  void set_serial(const std::string& serial) {
    serial.copy(sensor_.serial, FakeSensor::kSerialBytes - 1);
    sensor_.serial[serial.size()] = '\0';
  }
  void make(const std::string& options) {
    camera_ = make_camera(
        parse_config("driver = \"openni2\"\nplugins = \"" + kPlugins + "\"\n" + options, "g.toml"),
        clock_);
  }
  void start(const std::string& options) {
    make(options);
    pool_ = std::make_unique<FramePool>(4, kSensorWidth, kSensorHeight, true);
    ASSERT_TRUE(camera_->open().ok()) << camera_->problem();
    ASSERT_TRUE(camera_->start(*pool_, {}).ok());
    ASSERT_TRUE(wait([&] { return pool_->published() > 3; }, 5.0));
  }
  bool wait(const std::function<bool()>& done, double seconds) const {
    const std::int64_t until_us = clock_.now_us() + static_cast<std::int64_t>(seconds * 1e6);
    while (clock_.now_us() < until_us) {
      if (done()) return true;
      clock_.sleep_until_us(clock_.now_us() + 2'000);
    }
    return done();
  }
  double seconds_until(const std::function<bool()>& done, double limit_s) const {
    const std::int64_t from_us = clock_.now_us();
    EXPECT_TRUE(wait(done, limit_s));
    return static_cast<double>(clock_.now_us() - from_us) * 1e-6;
  }
  bool in_state(CameraState state, double seconds) const {
    return wait([&] { return camera_->status().state == state; }, seconds);
  }

  FakeSensor& sensor_ = fake_sensor();
  MonotonicClock clock_;
  std::unique_ptr<FramePool> pool_;
  std::unique_ptr<Camera> camera_;
};

TEST_F(OpenNi, Delivers300FramesBitForBitAndUnmirrored) {
  sensor_.speed_up = 2;
  start("");
  std::vector<std::vector<std::uint16_t>> depth(kSensorPictures);
  std::vector<std::vector<Rgb8>> color(kSensorPictures);
  for (std::uint64_t n = 0; n < kSensorPictures; ++n) {
    for (int v = 0; v < kSensorHeight; ++v) {
      for (int u = 0; u < kSensorWidth; ++u) {
        depth[n].push_back(sensor_depth_mm(u, v, n));
        color[n].push_back(sensor_color(u, v, n));
      }
    }
  }
  std::uint64_t seen = 0;
  int colored = 0;
  for (int i = 0; i < 300; ++i) {
    FrameLease lease;
    ASSERT_TRUE(wait(
        [&] {
          lease = pool_->lease_latest();
          return lease.frame().sequence > seen;
        },
        5.0));
    const DepthFrame& frame = lease.frame();
    seen = frame.sequence;
    // The driver's time stamps are its frame numbers in periods.
    const auto n = static_cast<std::uint64_t>(frame.device_us / 33'333) % kSensorPictures;
    ASSERT_TRUE(std::equal(depth[n].begin(), depth[n].end(), frame.depth.data)) << "frame " << i;
    if (frame.color.empty()) continue;
    ++colored;
    ASSERT_TRUE(std::equal(color[n].begin(), color[n].end(), frame.color.data)) << "frame " << i;
  }
  EXPECT_GE(colored, 270) << "frames with colour";
  ASSERT_EQ(depth[0].size(), kPixels);
}

TEST_F(OpenNi, RefusesADeviceThatWillNotStopMirroring) {
  sensor_.stuck_mirror = 1;
  make("");
  EXPECT_FALSE(camera_->open().ok());
  EXPECT_NE(camera_->problem().find("mirrors"), std::string::npos) << camera_->problem();
}

TEST_F(OpenNi, DeliversNoColourThatIsNotRegistered) {
  sensor_.registers = 0;
  make("");
  const Result<CameraInfo> info = camera_->open();
  ASSERT_TRUE(info.ok());
  EXPECT_FALSE(info.value().has_color);
}

TEST_F(OpenNi, SaysWhichModeIsNotThere) {
  make("width = 320\nheight = 240");
  EXPECT_FALSE(camera_->open().ok());
  EXPECT_NE(camera_->problem().find("no depth of 320 x 240 at 30 Hz"), std::string::npos)
      << camera_->problem();
}

TEST_F(OpenNi, CountsTheFramesThatTheDeviceCountedAndNobodyGot) {
  start("color = false");
  const std::uint64_t before = camera_->status().counters.dropped;
  sensor_.skip_frames = 3;
  EXPECT_TRUE(wait([&] { return camera_->status().counters.dropped == before + 3; }, 3.0))
      << camera_->status().counters.dropped - before;
}

TEST_F(OpenNi, SaysWithinASecondThatItWasUnpluggedAndIsBackWithinThreeAtAnotherAddress) {
  start("");
  for (int round = 0; round < 3; ++round) {
    sensor_.plugged = 0;
    EXPECT_LT(seconds_until([&] { return camera_->status().state == CameraState::Lost; }, 5.0),
              1.0);
    EXPECT_EQ(camera_->status().code, Code::SensorNotConnected);
    plug_in(sensor_);
    EXPECT_LT(seconds_until([&] { return camera_->status().state == CameraState::Streaming; }, 9.0),
              3.0);
    EXPECT_EQ(camera_->status().code, Code::SensorHealthy);
  }
  EXPECT_EQ(camera_->status().counters.reconnects, 3u);
}

TEST_F(OpenNi, RefusesAnotherSerialAtFirstAndAfterARePlug) {
  make("serial = \"77\"");
  const Result<CameraInfo> info = camera_->open();
  ASSERT_FALSE(info.ok());
  EXPECT_EQ(info.error().code, Code::WrongSerial);
  EXPECT_EQ(camera_->problem().find("serial 77 is wanted, 1206090012 is there"), 0u)
      << camera_->problem();
  start("");
  sensor_.plugged = 0;
  ASSERT_TRUE(in_state(CameraState::Lost, 3.0));
  set_serial("77");
  plug_in(sensor_);
  EXPECT_TRUE(wait([&] { return camera_->status().code == Code::WrongSerial; }, 3.0));
}

// After a disconnection OpenNI's own "is valid" stays true and a read blocks for ever.
TEST_F(OpenNi, NoticesADeviceThatGoesWithoutACallback) {
  start("");
  sensor_.says_goodbye = 0;
  sensor_.plugged = 0;
  EXPECT_TRUE(in_state(CameraState::Lost, 3.0));
  EXPECT_EQ(camera_->status().code, Code::NoFrameInTime);
  sensor_.says_goodbye = 1;
  plug_in(sensor_);
  EXPECT_TRUE(in_state(CameraState::Streaming, 6.0));
}

TEST_F(OpenNi, ReopensTheDeviceWhenItsFramesStop) {
  start("");
  sensor_.silent = 1;
  EXPECT_LT(seconds_until([&] { return camera_->status().code == Code::NoFrameInTime; }, 3.0), 0.6);
  EXPECT_TRUE(in_state(CameraState::Lost, 3.0));
  sensor_.silent = 0;
  EXPECT_TRUE(in_state(CameraState::Streaming, 6.0));
}

// Stopping streams against the library's frame threads can deadlock with listeners.
TEST_F(OpenNi, StopsAndStartsAgainManyTimesWhileFramesPourIn) {
  sensor_.speed_up = 8;
  start("");
  for (int round = 0; round < 20; ++round) {
    camera_->stop();
    ASSERT_TRUE(camera_->start(*pool_, {}).ok());
    ASSERT_TRUE(wait([&, seen = pool_->published()] { return pool_->published() > seen; }, 5.0))
        << round;
  }
}

// The library asks the system after threads that once called it and have ended: it crashed.
TEST_F(OpenNi, SurvivesReconnectionsAfterManyThreadsHaveUsedIt) {
  start("");
  for (int round = 0; round < 6; ++round) {
    std::thread([&] { camera_->close(); }).join();
    std::thread([&] { EXPECT_TRUE(camera_->open().ok()) << camera_->problem(); }).join();
    std::thread([&] { EXPECT_TRUE(camera_->start(*pool_, {}).ok()); }).join();
    ASSERT_TRUE(in_state(CameraState::Streaming, 5.0));
    sensor_.plugged = 0;
    ASSERT_TRUE(in_state(CameraState::Lost, 5.0));
    plug_in(sensor_);
    ASSERT_TRUE(in_state(CameraState::Streaming, 5.0));
  }
}

TEST_F(OpenNi, IsLostNotWaitedForWhileACallOfTheLibraryDoesNotReturn) {
  start("");
  sensor_.hang_stop = 1;
  camera_->stop();
  ASSERT_TRUE(wait([&] { return camera_->status().code == Code::NoFrameInTime; }, 5.0));
  EXPECT_LT(seconds_until(
                [&] {
                  camera_.reset();
                  return true;
                },
                8.0),
            7.0);
  sensor_.hang_stop = 0;
}

TEST_F(OpenNi, OpensAnotherCameraOnceAHungOneHasReturned) {
  sensor_.hang_open = 1;
  make("");
  const Result<CameraInfo> info = camera_->open();
  ASSERT_FALSE(info.ok());
  EXPECT_EQ(info.error().code, Code::NoFrameInTime);
  camera_.reset();
  sensor_.hang_open = 0;
  start("");
  EXPECT_EQ(camera_->status().state, CameraState::Streaming);
}

TEST_F(OpenNi, LeavesColourOutThatIsNotOfTheSameMoment) {
  sensor_.color_skew_us = 2'500;
  start("");
  FrameLease lease = pool_->lease_latest();
  EXPECT_TRUE(lease.frame().color.empty());
  EXPECT_TRUE(wait([&] { return camera_->status().code == Code::ColorMissing; }, 3.0));
}

// Seeking crashes, frame listeners deadlock, the recorder deadlocks and doubles its files, the
// player crashes at random: none of them is called in this program.
TEST(OpenNiSources, CallNothingThatIsKnownToHangOrCrash) {
  static const std::regex kForbidden(
      R"(\bseek\b|NewFrameListener|\bRecorder\b|PlaybackControl|OPENNI2_DRIVERS_PATH)");
  int files = 0;
  for (const auto& entry :
       std::filesystem::directory_iterator(GRAPNEL_SOURCE_DIR "/drivers/openni2")) {
    if (entry.path().extension() != ".cpp") continue;
    ++files;
    std::stringstream text;
    text << std::ifstream(entry.path()).rdbuf();
    EXPECT_FALSE(std::regex_search(text.str(), kForbidden)) << entry.path();
  }
  EXPECT_GE(files, 4);
}

// The player's process may play, which the camera's may not; neither seeks nor records, and it ends
// without tidying up.
TEST(OpenNiSources, OfThePlayerNeitherSeekNorListenNorRecordNorTidyUp) {
  static const std::regex kForbidden(
      R"(\bseek\(|NewFrameListener|\bRecorder\b|destroy\(|shutdown\(|\bexit\()");
  std::stringstream text;
  text << std::ifstream(GRAPNEL_SOURCE_DIR "/drivers/openni2/player/player_main.cpp").rdbuf();
  ASSERT_NE(text.str().find("setSpeed"), std::string::npos);
  EXPECT_FALSE(std::regex_search(text.str(), kForbidden));
}

TEST(OpenNiSources, ChangeNoWorkingFolderUnderOtherThreads) {
  // Bringing the library up changes it for a moment; making the camera has seen that through.
  const std::filesystem::path before = std::filesystem::current_path();
  (void)fake_sensor();
  const MonotonicClock clock;
  const auto camera = make_camera(
      parse_config("driver = \"openni2\"\nplugins = \"" + kPlugins + "\"\n", "g.toml"), clock);
  EXPECT_EQ(std::filesystem::current_path(), before);
}

}  // namespace
}  // namespace grapnel::test
