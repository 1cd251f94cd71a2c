#include "firmware_app/sensor_health.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace grapnel {
namespace {

constexpr std::int64_t kBeat_us = 100'000;

class Health : public testing::Test {
 protected:
  Health() {
    status_.state = CameraState::Streaming;
    status_.gravity = {0.0F, 1.0F, 0.0F};
  }
  /// So many beats at a frame rate, each frame without so many packets.
  Code beats(int count, int frames_a_beat = 3, std::uint64_t lost_a_frame = 0) {
    Code code = Code::Ok;
    for (int i = 0; i < count; ++i) {
      now_us_ += kBeat_us;
      status_.counters.frames += static_cast<std::uint64_t>(frames_a_beat);
      status_.counters.lost_packets += lost_a_frame * static_cast<std::uint64_t>(frames_a_beat);
      code = health_.judge(driver_, status_, live_, now_us_);
    }
    return code;
  }
  void look(double share) {
    std::vector<std::uint16_t> depth(1000, 0);
    for (std::size_t i = 0; i < static_cast<std::size_t>(share * 1000.0); ++i) depth[i] = 900;
    DepthFrame frame;
    frame.depth = {depth.data(), 100, 10};
    health_.see(frame);
  }

  CaptureSettings settings_;
  SensorHealth health_{settings_};
  CameraStatus status_;
  Code driver_ = Code::SensorHealthy;
  bool live_ = true;
  std::int64_t now_us_ = 1'000'000;
};

TEST_F(Health, IsGoodWhileEverythingIsAsItShouldBe) {
  look(0.5);
  EXPECT_EQ(beats(100), Code::SensorHealthy);
  EXPECT_EQ(health_.tilt_rad(), 0.0);
}

TEST_F(Health, PutsWhatTheDriverSaysFirst) {
  driver_ = Code::WrongSerial;
  EXPECT_EQ(beats(100, 0), Code::WrongSerial);
}

TEST_F(Health, MissesColourOnlyWhereItIsNeeded) {
  driver_ = Code::ColorMissing;
  EXPECT_EQ(beats(1), Code::SensorHealthy);
  settings_.need_color = true;
  health_ = SensorHealth(settings_);
  EXPECT_EQ(beats(1), Code::ColorMissing);
}

TEST_F(Health, NoticesARateBelowTheLimitAndItsRecovery) {
  EXPECT_EQ(beats(30), Code::SensorHealthy);
  EXPECT_EQ(beats(45, 0), Code::NoFrameInTime);
  EXPECT_EQ(beats(45), Code::SensorHealthy);
}

TEST_F(Health, JudgesNoRateOfARecording) {
  live_ = false;
  EXPECT_EQ(beats(60, 0), Code::SensorHealthy);
}

TEST_F(Health, NoticesThatFramesLosePacketsAllTheTime) {
  EXPECT_EQ(beats(45, 3, 50), Code::SensorHealthy);
  EXPECT_EQ(beats(45, 3, 51), Code::LostPackets);
  EXPECT_EQ(beats(45), Code::SensorHealthy);
}

TEST_F(Health, IsBlindAfterThreeLooksWithoutReadings) {
  look(0.01);
  look(0.01);
  EXPECT_EQ(beats(1), Code::SensorHealthy);
  look(0.01);
  EXPECT_EQ(beats(1), Code::DepthMostlyInvalid);
  look(0.5);
  EXPECT_EQ(beats(1), Code::SensorHealthy);
}

TEST_F(Health, NoticesThatTheCameraWasTurnedUntilThePlaceIsTaughtAnew) {
  EXPECT_EQ(beats(10), Code::SensorHealthy);
  // Three degrees; a limit of two.
  const float angle_rad = 3.0F * 3.14159265F / 180.0F;
  status_.gravity = {std::sin(angle_rad), std::cos(angle_rad), 0.0F};
  EXPECT_EQ(beats(2), Code::SensorHealthy) << "a shock";
  EXPECT_EQ(beats(60), Code::SensorMoved);
  EXPECT_NEAR(health_.tilt_rad(), angle_rad, 0.001);
  health_.take_reference();
  EXPECT_EQ(beats(1), Code::SensorHealthy);
}

TEST_F(Health, ComparesWithThePlaceThatIsWrittenDown) {
  settings_.gravity = {0.0, 0.8, 0.6};
  health_ = SensorHealth(settings_);
  EXPECT_EQ(beats(1), Code::SensorMoved);
  // The angle between (0, 1, 0) and (0, 0.8, 0.6).
  EXPECT_NEAR(health_.tilt_rad(), std::acos(0.8), 1e-6);
}

TEST_F(Health, KnowsNoTiltOfASensorWithoutAccelerometer) {
  status_.gravity = {};
  EXPECT_EQ(beats(50), Code::SensorHealthy);
  EXPECT_EQ(health_.tilt_rad(), 0.0);
}

}  // namespace
}  // namespace grapnel
