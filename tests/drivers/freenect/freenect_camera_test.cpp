// The driver of the Kinect with Debian's libfreenect, over a simulated USB.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "base/clock.h"
#include "base/config.h"
#include "drivers/registry.h"
#include "tests/support/fake_usb/fake_kinect.h"
#include "tests/support/sanitized.h"

namespace grapnel::test {
namespace {

constexpr int kPixels = kFakeWidth * kFakeHeight;

/// Millimetres of a raw value by the factory constants: libfreenect's registration.c.
double law_mm(int raw) {
  const double shift_px = (raw - 4.0 * kFakeConstShift) / 4.0 - 0.375;
  const double metric = shift_px * static_cast<double>(kFakePixel_mm);
  return 10.0 * (metric * kFakeReference_mm / (static_cast<double>(kFakeEmitter_cm) - metric) +
                 kFakeReference_mm);
}

std::uint16_t whole_mm(int raw) {
  return raw == 2047 ? std::uint16_t{0} : static_cast<std::uint16_t>(law_mm(raw));
}

std::uint16_t fine_steps(int raw) {
  return raw == 2047 ? std::uint16_t{0} : static_cast<std::uint16_t>(law_mm(raw) / 0.2 + 0.5);
}

/// Where a depth pixel lies in the colour image, or -1. The fake's registration polynomials are
/// zero, so only the shift by depth is left, and one pixel both ways that the library adds.
int registered_place(int u, int v, unsigned mm) {
  const double pixels_per_mm = 1.0 / (static_cast<double>(kFakePixel_mm) * 2.0 * 10.0);
  // The library takes 2.4 cm between the cameras whatever the device says.
  const double between_px = static_cast<double>(2.4F) * pixels_per_mm * 10.0;
  const double reference_px = kFakeReference_mm * pixels_per_mm * 10.0;
  const double depth_px = mm * pixels_per_mm;
  const double shift_px = between_px * (depth_px - reference_px) / depth_px + 0.375;
  if (u + 1 >= kFakeWidth || v + 1 >= kFakeHeight) return -1;
  const int x = ((u + 1) * 256 + static_cast<int>(shift_px * 256)) / 256;
  return x < 0 || x >= kFakeWidth ? -1 : (v + 1) * kFakeWidth + x;
}

std::vector<std::uint16_t> registered_image(std::uint64_t n) {
  std::vector<std::uint16_t> image(kPixels, 0);
  for (int v = 0; v < kFakeHeight; ++v) {
    for (int u = 0; u < kFakeWidth; ++u) {
      const std::uint16_t mm = whole_mm(fake_raw_depth(u, v, n));
      const int place = mm == 0 ? -1 : registered_place(u, v, mm);
      if (place < 0) continue;
      std::uint16_t& nearest = image[static_cast<std::size_t>(place)];
      if (nearest == 0 || mm < nearest) nearest = mm;
    }
  }
  return image;
}

std::vector<std::uint16_t> image_of(std::uint64_t n, const std::function<std::uint16_t(int)>& law) {
  std::vector<std::uint16_t> image;
  image.reserve(kPixels);
  for (int v = 0; v < kFakeHeight; ++v) {
    for (int u = 0; u < kFakeWidth; ++u) image.push_back(law(fake_raw_depth(u, v, n)));
  }
  return image;
}

/// Share of the pixels around (centre_u, 240) that have the colour; -1 when one has another that is
/// not black.
double colored_share(const ImageView<const Rgb8>& color, int centre_u, const Rgb8& expected) {
  int right = 0;
  for (int v = 230; v < 250; ++v) {
    for (int u = centre_u - 10; u < centre_u + 10; ++u) {
      const Rgb8 pixel = color.at(u, v);
      if (pixel == expected) ++right;
      if (!(pixel == expected) && !(pixel == Rgb8{})) return -1.0;
    }
  }
  return right / 400.0;
}

class Kinect : public testing::Test {
 protected:
  void SetUp() override {
    FakeKinect& kinect = *grapnel_fake_kinect();
    kinect.plugged = 1;
    kinect.motor = 1;
    kinect.rate_hz = 30;
    kinect.first_ticks = 0;
    kinect.color_skew_us = 500;
    for (auto* fault : {&kinect.color_frozen, &kinect.silent, &kinect.lose_every, &kinect.lose_next,
                        &kinect.clock_frozen, &kinect.hang_control, &kinect.hang_events,
                        &kinect.hang_open, &kinect.denied}) {
      *fault = 0;
    }
    set_serial("A00362A01234043A");
  }
  void TearDown() override {
    camera_.reset();
    // Everything that was opened has been closed, also what hung for a while.
    FakeKinect& kinect = *grapnel_fake_kinect();
    EXPECT_TRUE(wait([&] { return kinect.handles == 0 && kinect.transfers == 0; }, 3.0))
        << kinect.handles << " handles, " << kinect.transfers << " transfers";
  }

  static void set_serial(const std::string& serial) {
    serial.copy(grapnel_fake_kinect()->serial, FakeKinect::kSerialBytes - 1);
    grapnel_fake_kinect()->serial[serial.size()] = '\0';
  }

  void make(const std::string& options) {
    camera_ = make_camera(
        parse_config(
            "driver = \"freenect\"\nplugins = \"" GRAPNEL_BINARY_DIR "/bin/cameras\"\n" + options,
            "grapnel.toml"),
        clock_);
  }
  void start(const std::string& options, std::size_t slots = 4) {
    make(options);
    pool_ = std::make_unique<FramePool>(slots, kFakeWidth, kFakeHeight, true);
    ASSERT_TRUE(camera_->open().ok()) << camera_->problem();
    ASSERT_TRUE(camera_->start(*pool_, {}).ok());
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
  /// Looks at so many successive frames.
  void each_frame(int count, const std::function<void(const DepthFrame&)>& look) {
    std::uint64_t seen = 0;
    for (int i = 0; i < count; ++i) {
      FrameLease lease;
      ASSERT_TRUE(wait(
          [&] {
            lease = pool_->lease_latest();
            return lease.valid() && (i == 0 || lease.frame().sequence > seen);
          },
          5.0));
      seen = lease.frame().sequence;
      look(lease.frame());
      if (HasFatalFailure()) return;
    }
  }
  [[nodiscard]] static std::uint64_t number_of(const DepthFrame& frame) {
    const std::int64_t period_us = 1'000'000 / grapnel_fake_kinect()->rate_hz.load();
    return static_cast<std::uint64_t>((frame.device_us + period_us / 2) / period_us);
  }

  MonotonicClock clock_;
  std::unique_ptr<FramePool> pool_;
  std::unique_ptr<Camera> camera_;
};

struct Mode {
  const char* name;
  const char* options;
};

class KinectMode : public Kinect, public testing::WithParamInterface<Mode> {};

TEST_P(KinectMode, Delivers300FramesBitForBitAsTheDeviceSentThem) {
  grapnel_fake_kinect()->rate_hz = 60;
  const std::string name = GetParam().name;
  std::vector<std::vector<std::uint16_t>> expected;
  for (std::uint64_t n = 0; n < kFakePictures; ++n) {
    expected.push_back(name == "Registered" ? registered_image(n)
                       : name == "Raw"      ? image_of(n, fine_steps)
                                            : image_of(n, whole_mm));
  }
  start(GetParam().options);
  int colored = 0;
  each_frame(300, [&](const DepthFrame& frame) {
    const std::uint64_t n = number_of(frame);
    const auto& picture = expected[n % kFakePictures];
    ASSERT_TRUE(std::equal(picture.begin(), picture.end(), frame.depth.data)) << "frame " << n;
    ASSERT_EQ(frame.lost_packets, 0u);
    if (frame.color.empty()) return;
    ++colored;
    // Far from the border between the two fields and from the edges: a depth pixel's colour comes
    // from up to 60 pixels beside it, or is black where the colour camera does not see the point.
    EXPECT_GT(colored_share(frame.color, 200, fake_color(true, n)), 0.3);
    EXPECT_GT(colored_share(frame.color, 440, fake_color(false, n)), 0.3);
  });
  // All of them on an idle machine; one that can't keep up skips frames of either stream.
  EXPECT_GE(colored, kSanitized ? 1 : 240) << "frames with colour";
  EXPECT_EQ(camera_->status().counters.lost_packets, 0u);
}

INSTANTIATE_TEST_SUITE_P(All, KinectMode,
                         testing::Values(Mode{"Millimetres", "depth = \"mm\""},
                                         Mode{"Raw", "depth = \"raw\""},
                                         Mode{"Registered", "depth = \"registered\""}),
                         [](const auto& tested) { return std::string(tested.param.name); });

TEST_F(Kinect, CountsAndMarksLostPacketsAndLetsNoStaleStripeThrough) {
  FakeKinect& kinect = *grapnel_fake_kinect();
  kinect.rate_hz = 60;
  start("color = false");
  ASSERT_TRUE(wait([&] { return pool_->published() > 3; }, 3.0));
  std::vector<std::vector<std::uint16_t>> expected;
  for (std::uint64_t n = 0; n < kFakePictures; ++n) expected.push_back(image_of(n, whole_mm));
  kinect.depth_packets_lost = 0;
  kinect.lose_every = 2000;
  int marked = 0;
  each_frame(200, [&](const DepthFrame& frame) {
    const auto& picture = expected[number_of(frame) % kFakePictures];
    int wrong = 0;
    int blank = 0;
    for (std::size_t i = 0; i < picture.size(); ++i) {
      if (frame.depth.data[i] == picture[i]) continue;
      ++(frame.depth.data[i] == 0 ? blank : wrong);
    }
    EXPECT_EQ(blank > 0, frame.lost_packets > 0);
    marked += frame.lost_packets > 0 ? 1 : 0;
    // Of a packet's 1748 bytes only the values at its two ends are torn between two packets.
    EXPECT_LE(wrong, static_cast<int>(2 * frame.lost_packets));
    EXPECT_LE(blank, static_cast<int>(1273 * frame.lost_packets));
  });
  EXPECT_GE(marked, 10) << "200 frames of 242 packets, one of 2000 lost: 24";
  kinect.lose_every = 0;
  const std::uint64_t before = pool_->published();
  ASSERT_TRUE(wait([&] { return pool_->published() > before + 3; }, 3.0));
  EXPECT_EQ(camera_->status().counters.lost_packets, kinect.depth_packets_lost.load());
}

TEST_F(Kinect, DropsAndCountsAFrameOfWhichTooMuchIsMissing) {
  start("color = false");
  ASSERT_TRUE(wait([&] { return pool_->published() > 3; }, 3.0));
  grapnel_fake_kinect()->lose_next = 20;
  ASSERT_TRUE(wait([&] { return camera_->status().counters.dropped == 1; }, 3.0));
  EXPECT_EQ(camera_->status().state, CameraState::Streaming);
}

TEST_F(Kinect, SaysWithinASecondThatItWasUnpluggedAndIsBackWithinThreeAtAnotherAddress) {
  FakeKinect& kinect = *grapnel_fake_kinect();
  start("");
  ASSERT_TRUE(wait([&] { return pool_->published() > 3; }, 3.0));
  for (int round = 0; round < 3; ++round) {
    kinect.plugged = 0;
    EXPECT_LT(seconds_until([&] { return camera_->status().state == CameraState::Lost; }, 5.0),
              1.0);
    EXPECT_EQ(camera_->status().code, Code::SensorNotConnected);
    EXPECT_NE(camera_->problem(), "");
    ++kinect.address;
    kinect.plugged = 1;
    EXPECT_LT(seconds_until([&] { return camera_->status().state == CameraState::Streaming; }, 9.0),
              3.0);
    EXPECT_EQ(camera_->status().code, Code::SensorHealthy);
  }
  EXPECT_EQ(camera_->status().counters.reconnects, 3u);
}

TEST_F(Kinect, RefusesAnotherSerialAtFirstAndAfterARePlug) {
  FakeKinect& kinect = *grapnel_fake_kinect();
  make("serial = \"B00000000000000B\"");
  const Result<CameraInfo> info = camera_->open();
  ASSERT_FALSE(info.ok());
  EXPECT_EQ(info.error().code, Code::WrongSerial);
  EXPECT_EQ(camera_->problem(), "serial B00000000000000B is wanted, A00362A01234043A is there");

  start("");
  ASSERT_TRUE(wait([&] { return pool_->published() > 3; }, 3.0));
  kinect.plugged = 0;
  ASSERT_TRUE(wait([&] { return camera_->status().state == CameraState::Lost; }, 3.0));
  set_serial("B00000000000000B");
  ++kinect.address;
  kinect.plugged = 1;
  EXPECT_TRUE(wait([&] { return camera_->status().code == Code::WrongSerial; }, 3.0));
  const std::uint64_t published = pool_->published();
  clock_.sleep_until_us(clock_.now_us() + 1'000'000);
  EXPECT_EQ(pool_->published(), published);
}

TEST_F(Kinect, PassesTheWrapOfItsClockWithoutAJump) {
  // 60 MHz in 32 bits: the counter starts over 71.6 s after plugging in; here, in a second.
  start("");
  ASSERT_TRUE(wait([&] { return pool_->published() > 1; }, 3.0));
  FrameLease lease = pool_->lease_latest();
  const auto now_ticks = static_cast<std::uint32_t>(lease.frame().device_us * kFakeTicksPerUs);
  lease.release();
  camera_->close();
  // Two and a half seconds before the end.
  grapnel_fake_kinect()->first_ticks = 0U - now_ticks - 150'000'000U;
  start("");
  std::int64_t device_us = 0;
  std::int64_t exposure_us = 0;
  std::uint64_t sequence = 0;
  bool wrapped = false;
  each_frame(110, [&](const DepthFrame& frame) {
    if (sequence != 0) {
      const auto frames = static_cast<double>(frame.sequence - sequence);
      EXPECT_NEAR(static_cast<double>(frame.device_us - device_us), frames * 33'333.0, 1.0);
      // Host time follows the device's but for the arrival's variation on a busy machine.
      EXPECT_NEAR(static_cast<double>(frame.exposure_us - exposure_us), frames * 33'333.0, 20'000);
    }
    wrapped |= frame.device_us > (std::int64_t{1} << 32) / kFakeTicksPerUs;
    device_us = frame.device_us;
    exposure_us = frame.exposure_us;
    sequence = frame.sequence;
    EXPECT_EQ(camera_->status().code, Code::SensorHealthy);
  });
  EXPECT_TRUE(wrapped);
}

TEST_F(Kinect, TellsAClockThatStandsStill) {
  start("");
  ASSERT_TRUE(wait([&] { return pool_->published() > 3; }, 3.0));
  grapnel_fake_kinect()->clock_frozen = 1;
  EXPECT_TRUE(wait([&] { return camera_->status().code == Code::ClockFault; }, 2.0));
  grapnel_fake_kinect()->clock_frozen = 0;
  EXPECT_TRUE(wait([&] { return camera_->status().code == Code::SensorHealthy; }, 2.0));
}

TEST_F(Kinect, LeavesColourOutThatIsNotOfTheSameMoment) {
  grapnel_fake_kinect()->color_skew_us = 2'500;
  start("");
  each_frame(20, [](const DepthFrame& frame) { EXPECT_TRUE(frame.color.empty()); });
  EXPECT_TRUE(wait([&] { return camera_->status().code == Code::ColorMissing; }, 3.0));
  camera_->close();
  grapnel_fake_kinect()->color_skew_us = -1'900;
  start("");
  int colored = 0;
  each_frame(20, [&](const DepthFrame& frame) { colored += frame.color.empty() ? 0 : 1; });
  EXPECT_GE(colored, kSanitized ? 1 : 18);
}

TEST_F(Kinect, DeliversDepthWithoutColourThatDoesNotCome) {
  grapnel_fake_kinect()->color_frozen = 1;
  start("");
  ASSERT_TRUE(wait([&] { return pool_->published() > 40; }, 5.0));
  EXPECT_EQ(camera_->status().code, Code::ColorMissing);
  EXPECT_EQ(camera_->status().counters.dropped, 0u);
}

TEST_F(Kinect, ReopensTheDeviceWhenItsFramesStop) {
  start("");
  ASSERT_TRUE(wait([&] { return pool_->published() > 3; }, 3.0));
  grapnel_fake_kinect()->silent = 1;
  EXPECT_LT(seconds_until([&] { return camera_->status().code == Code::NoFrameInTime; }, 3.0), 0.6);
  EXPECT_TRUE(wait([&] { return camera_->status().state == CameraState::Lost; }, 3.0));
  EXPECT_EQ(camera_->status().code, Code::NoFrameInTime);
  grapnel_fake_kinect()->silent = 0;
  EXPECT_TRUE(wait([&] { return camera_->status().state == CameraState::Streaming; }, 6.0));
}

TEST_F(Kinect, IsLostNotWaitedForWhenACallOfTheLibraryNeverReturns) {
  FakeKinect& kinect = *grapnel_fake_kinect();
  start("");
  ASSERT_TRUE(wait([&] { return pool_->published() > 3; }, 3.0));
  kinect.hang_events = 1;
  EXPECT_TRUE(wait([&] { return camera_->status().state == CameraState::Lost; }, 4.0));
  EXPECT_LT(seconds_until(
                [&] {
                  camera_->stop();
                  return true;
                },
                1.0),
            0.5);
  EXPECT_LT(seconds_until(
                [&] {
                  camera_->close();
                  return true;
                },
                8.0),
            7.0);
  EXPECT_LT(seconds_until(
                [&] {
                  camera_.reset();
                  return true;
                },
                1.0),
            0.5);
  kinect.hang_events = 0;
}

TEST_F(Kinect, ComesBackAfterAHungCallOnceTheDeviceIsPluggedInAgain) {
  FakeKinect& kinect = *grapnel_fake_kinect();
  start("");
  ASSERT_TRUE(wait([&] { return pool_->published() > 3; }, 3.0));
  kinect.hang_events = 1;
  ASSERT_TRUE(wait([&] { return camera_->status().state == CameraState::Lost; }, 4.0));
  kinect.hang_events = 0;
  ++kinect.address;
  EXPECT_TRUE(wait([&] { return camera_->status().state == CameraState::Streaming; }, 8.0));
}

TEST_F(Kinect, AnswersWhenOpeningItNeverReturns) {
  grapnel_fake_kinect()->hang_open = 1;
  make("");
  const std::int64_t from_us = clock_.now_us();
  const Result<CameraInfo> info = camera_->open();
  EXPECT_LT(clock_.now_us() - from_us, 8'000'000);
  ASSERT_FALSE(info.ok());
  EXPECT_EQ(info.error().code, Code::NoFrameInTime);
  camera_.reset();
  grapnel_fake_kinect()->hang_open = 0;
}

TEST_F(Kinect, SaysWhatToDoWhenItMayNotBeOpened) {
  grapnel_fake_kinect()->denied = 1;
  make("");
  EXPECT_FALSE(camera_->open().ok());
  EXPECT_NE(camera_->problem().find("60-grapnel-camera.rules"), std::string::npos)
      << camera_->problem();
}

TEST_F(Kinect, FeelsWhichWayIsDownAndNeedsNoMotor) {
  FakeKinect& kinect = *grapnel_fake_kinect();
  kinect.acceleration[0] = 100;
  kinect.acceleration[1] = 810;
  start("");
  // 819 counts are one g.
  EXPECT_TRUE(wait([&] { return camera_->status().gravity[1] == 810.0F / 819.0F; }, 3.0));
  EXPECT_FLOAT_EQ(camera_->status().gravity[0], 100.0F / 819.0F);
  camera_->close();
  kinect.motor = 0;
  start("");
  EXPECT_TRUE(wait([&] { return pool_->published() > 3; }, 3.0));
  EXPECT_EQ(camera_->status().code, Code::SensorHealthy);
  EXPECT_EQ(camera_->status().gravity, (std::array<float, 3>{}));
  kinect.acceleration[0] = 0;
  kinect.acceleration[1] = 819;
}

}  // namespace
}  // namespace grapnel::test
