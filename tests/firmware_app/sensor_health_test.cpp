#include "firmware_app/sensor_health.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
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

/// A belt 1 m below the camera, turned about the image's horizontal by `tilt_rad` and raised by
/// `raised_m`, with 40 mm high boxes over a share of its tiles; steps of a Kinect.
class Belt : public Health {
 protected:
  Belt() { health_.watch_belt({true, {0.0, 0.0, -1.0}, 1.0}); }
  void look(double raised_m, double tilt_rad, double boxes) {
    draw([&](int u, int v) {
      const double y = (v - 119.5) / 287.5;
      const bool box = u / 40 % 2 == 0 && v < static_cast<int>(boxes * 2.0 * 240.0);
      // z = 1 - raised + tan(tilt) · y z, exact.
      return (1.0 - raised_m) / (1.0 - std::tan(tilt_rad) * y) - (box ? 0.04 : 0.0);
    });
  }
  /// So many looks at a belt of which flat parts cover the left share.
  Code flats(int count, double height_m, double share) {
    for (int i = 0; i < count; ++i) {
      draw([&](int u, int) { return u < share * 320.0 ? 1.0 - height_m : 1.0; });
    }
    return beats(1);
  }
  void draw(const std::function<double(int u, int v)>& z_m) {
    std::vector<std::uint16_t> depth;
    for (int v = 0; v < 240; ++v) {
      for (int u = 0; u < 320; ++u) {
        const double z = z_m(u, v);
        const double step = 2.9e-3;  // at 1 m
        depth.push_back(static_cast<std::uint16_t>(std::round(z / step) * step * 10'000.0));
      }
    }
    DepthFrame frame;
    frame.depth = {depth.data(), 320, 240};
    frame.intrinsics = {320, 240, 287.5, 287.5, 159.5, 119.5};
    frame.metres_per_unit = 1e-4;
    health_.see(frame);
  }
  Code looks(int count, double raised_m, double tilt_rad = 0.0, double boxes = 0.2) {
    for (int i = 0; i < count; ++i) look(raised_m, tilt_rad, boxes);
    return beats(1);
  }
};

TEST_F(Belt, IsWhereItWasTaughtUnderPartsThatLieOnIt) {
  EXPECT_EQ(looks(10, 0.0), Code::SensorHealthy);
  // Half a step of the sensor.
  EXPECT_NEAR(health_.belt_drift().shift_m, 0.0, 1.5e-3);
  EXPECT_NEAR(health_.belt_drift().tilt_rad, 0.0, 2e-3);
}

TEST_F(Belt, ThatCameNearerForGoodIsASensorThatMoved) {
  EXPECT_EQ(looks(4, 0.03), Code::SensorHealthy) << "something may lie there for a moment";
  EXPECT_EQ(looks(1, 0.03), Code::SensorMoved);
  EXPECT_NEAR(health_.belt_drift().shift_m, 0.03, 1.5e-3);
  EXPECT_EQ(looks(1, 0.0), Code::SensorHealthy);
}

TEST_F(Belt, ThatTurnedIsASensorThatMoved) {
  EXPECT_EQ(looks(5, 0.0, 0.03), Code::SensorHealthy);
  EXPECT_EQ(looks(5, 0.0, 0.05), Code::SensorMoved);
  EXPECT_NEAR(health_.belt_drift().tilt_rad, 0.05, 2e-3);
}

TEST_F(Belt, FarBelowIsAnotherPlace) {
  EXPECT_EQ(looks(5, -0.2), Code::SensorMoved);
  EXPECT_LT(health_.belt_drift().shift_m, -0.1);
}

TEST_F(Belt, CoveredByPartsSaysNothing) {
  EXPECT_EQ(looks(1, 0.0), Code::SensorHealthy);
  EXPECT_EQ(looks(10, 0.3), Code::SensorHealthy) << "a pallet before the camera";
}

TEST_F(Belt, UnderFlatPartsOverTheWholeViewHasNotMoved) {
  EXPECT_EQ(looks(5, 0.0), Code::SensorHealthy);
  EXPECT_EQ(flats(2, 0.04, 0.5), Code::SensorHealthy);
  EXPECT_EQ(flats(200, 0.04, 1.0), Code::SensorHealthy) << "the belt stands";
  EXPECT_EQ(flats(2, 0.04, 0.3), Code::SensorHealthy);
  EXPECT_EQ(looks(5, 0.0), Code::SensorHealthy);
  EXPECT_NEAR(health_.belt_drift().shift_m, 0.0, 1.5e-3);
}

TEST_F(Belt, ShowsInGapsBetweenFlatPartsThatItHasNotMoved) {
  // From the first look on, as after a start of the daemon; three of a hundred columns are belt.
  EXPECT_EQ(flats(400, 0.04, 0.97), Code::SensorHealthy);
  EXPECT_EQ(flats(400, 0.04, 0.6), Code::SensorHealthy);
  EXPECT_NEAR(health_.belt_drift().shift_m, 0.0, 1.5e-3) << "the lowest plane is the belt's";
}

TEST_F(Belt, ThatCameNearerUnderItsPartsIsASensorThatMoved) {
  EXPECT_EQ(looks(5, 0.0), Code::SensorHealthy);
  EXPECT_EQ(looks(4, 0.03), Code::SensorHealthy);
  EXPECT_EQ(looks(1, 0.03), Code::SensorMoved);
}

TEST_F(Belt, ThatCameNearerAtOnceAndIsEmptyIsASensorThatMoved) {
  EXPECT_EQ(looks(5, 0.0, 0.0, 0.0), Code::SensorHealthy);
  EXPECT_EQ(looks(5, 0.03, 0.0, 0.0), Code::SensorMoved);
}

TEST_F(Belt, FartherAwayIsASensorThatMovedWhateverLiesOnIt) {
  EXPECT_EQ(flats(5, 0.04, 0.5), Code::SensorHealthy);
  EXPECT_EQ(looks(5, -0.03, 0.0, 0.4), Code::SensorMoved);
  EXPECT_NEAR(health_.belt_drift().shift_m, -0.03, 2e-3);
}

TEST_F(Belt, CoveredForFiveMinutesMustBeSeenAgainToBeBelieved) {
  EXPECT_EQ(flats(2, 0.04, 0.5), Code::SensorHealthy);
  EXPECT_EQ(flats(300, 0.04, 1.0), Code::SensorHealthy);
  EXPECT_EQ(flats(5, 0.04, 1.0), Code::SensorMoved);
  EXPECT_EQ(flats(1, 0.04, 0.9), Code::SensorHealthy);
}

TEST_F(Belt, IsNotWatchedWhereThatIsSwitchedOffOrNothingWasTaught) {
  settings_.max_belt_shift_m = 0.0;
  health_ = SensorHealth(settings_);
  health_.watch_belt({true, {0.0, 0.0, -1.0}, 1.0});
  EXPECT_EQ(looks(10, 0.05), Code::SensorHealthy);
  settings_.max_belt_shift_m = 0.02;
  health_ = SensorHealth(settings_);
  EXPECT_EQ(looks(10, 0.05), Code::SensorHealthy);
}

TEST_F(Health, WarmsUpForAsLongAsItIsToldAndAgainAfterAMinuteAway) {
  settings_.warm_up_s = 10;
  health_ = SensorHealth(settings_);
  EXPECT_EQ(beats(99), Code::WarmingUp);
  EXPECT_EQ(beats(2), Code::SensorHealthy);
  status_.state = CameraState::Lost;
  driver_ = Code::SensorNotConnected;
  EXPECT_EQ(beats(20), Code::SensorNotConnected);
  status_.state = CameraState::Streaming;
  driver_ = Code::SensorHealthy;
  EXPECT_EQ(beats(1), Code::SensorHealthy);
  status_.state = CameraState::Lost;
  beats(610, 0);
  status_.state = CameraState::Streaming;
  EXPECT_EQ(beats(1), Code::WarmingUp);
}

}  // namespace
}  // namespace grapnel
