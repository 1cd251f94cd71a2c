#include "drivers/replay/replay_camera.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "base/file.h"
#include "base/input_error.h"
#include "tests/support/small_recording.h"
#include "tests/support/temp_folder.h"

namespace grapnel {
namespace {

constexpr std::int64_t kPatience_us = 10'000'000;

FramePool small_pool() { return FramePool(4, test::kSmallWidth, test::kSmallHeight, true); }

std::string depth_file(std::size_t frame) {
  return "depth/" +
         time_text(test::kSmallStart_us +
                   static_cast<std::int64_t>(frame) * test::kSmallInterval_us) +
         ".png";
}

bool wait_until(const FramePool& pool, const std::function<bool()>& done) {
  const MonotonicClock clock;
  const std::int64_t until_us = clock.now_us() + kPatience_us;
  while (!done() && clock.now_us() < until_us) {
    pool.published_signal().wait(pool.published_signal().version(), 5'000);
  }
  return done();
}

class Replay : public testing::Test {
 protected:
  void record(std::size_t frames) {
    test::write_small_recording(folder_ / "r", frames, true);
    options_.path = (folder_ / "r").string();
  }
  ReplayCamera& make(const Clock& clock) {
    camera_ = std::make_unique<ReplayCamera>(options_, clock);
    return *camera_;
  }
  ReplayCamera& start(const Clock& clock) {
    make(clock);
    EXPECT_TRUE(camera_->open().ok()) << camera_->problem();
    EXPECT_TRUE(camera_->start(pool_, {}).ok());
    return *camera_;
  }
  /// Plays to the end, as fast as it goes.
  CameraStatus play_all() {
    options_.mode = ReplayMode::Fast;
    ReplayCamera& camera = start(real_time_);
    EXPECT_TRUE(wait_until(pool_, [&] { return camera.status().state != CameraState::Streaming; }));
    return camera.status();
  }

  test::TempFolder folder_;
  ReplayOptions options_;
  MonotonicClock real_time_;
  FramePool pool_ = small_pool();
  std::unique_ptr<ReplayCamera> camera_;
};

TEST_F(Replay, HandsOutOneFrameAtEachStepWithItsPixels) {
  record(3);
  options_.mode = ReplayMode::Stepped;
  ReplayCamera& camera = start(real_time_);
  for (std::size_t n = 0; n < 3; ++n) {
    ASSERT_TRUE(camera.step());
    ASSERT_EQ(pool_.published(), n + 1);
    const FrameLease lease = pool_.lease_latest();
    const DepthFrame& frame = lease.frame();
    EXPECT_EQ(frame.sequence, n);
    EXPECT_EQ(frame.device_us,
              test::kSmallStart_us + static_cast<std::int64_t>(n) * test::kSmallInterval_us);
    for (std::size_t pixel = 0; pixel < frame.depth.pixels(); ++pixel) {
      ASSERT_EQ(frame.depth.data[pixel], test::small_depth(n, pixel));
      ASSERT_EQ(frame.color.data[pixel], test::small_color(n, pixel));
    }
  }
  EXPECT_FALSE(camera.step());
  EXPECT_EQ(camera.status().state, CameraState::Ended);
  EXPECT_EQ(camera.status().code, Code::NoFrameInTime);
  EXPECT_EQ(camera.problem(), "");
}

TEST_F(Replay, HandsOutAFrameToWhoeverAsksForOne) {
  record(2);
  options_.mode = ReplayMode::Stepped;
  Camera& camera = start(real_time_);
  EXPECT_TRUE(camera.stepped());
  constexpr std::int64_t kLimit_us = 10'000'000;
  for (std::uint64_t n = 1; n <= 2; ++n) {
    const std::uint32_t seen = pool_.published_signal().version();
    camera.request_frame();
    if (pool_.published() < n) pool_.published_signal().wait(seen, kLimit_us);
    EXPECT_EQ(pool_.published(), n);
  }
}

TEST_F(Replay, RunsOnInTimeAndSequenceWhenItBeginsAgain) {
  record(2);
  options_.mode = ReplayMode::Stepped;
  options_.loop = true;
  ReplayCamera& camera = start(real_time_);
  std::int64_t exposure_us = 0;
  for (std::size_t n = 0; n < 5; ++n) {
    ASSERT_TRUE(camera.step());
    const FrameLease lease = pool_.lease_latest();
    EXPECT_EQ(test::frame_shown(lease.frame().depth), n % 2);
    EXPECT_EQ(lease.frame().sequence, n);
    // Two frames 10 ms apart make a lap of 20 ms.
    EXPECT_EQ(lease.frame().device_us,
              test::kSmallStart_us + static_cast<std::int64_t>(n) * test::kSmallInterval_us);
    EXPECT_GT(lease.frame().exposure_us, exposure_us);
    exposure_us = lease.frame().exposure_us;
  }
}

TEST_F(Replay, PlaysOnlyTheRangeAskedFor) {
  record(6);
  options_.start = 2;
  options_.count = 3;
  options_.mode = ReplayMode::Stepped;
  ReplayCamera& camera = start(real_time_);
  for (std::size_t frame = 2; frame < 5; ++frame) {
    ASSERT_TRUE(camera.step());
    EXPECT_EQ(test::frame_shown(pool_.lease_latest().frame().depth), frame);
  }
  EXPECT_FALSE(camera.step());
}

TEST_F(Replay, RefusesARangeOutsideTheRecording) {
  record(2);
  options_.start = 2;
  ReplayCamera& camera = make(real_time_);
  EXPECT_FALSE(camera.open().ok());
  EXPECT_NE(camera.problem().find("start 2 is not allowed; the recording's frames are 0 to 1"),
            std::string::npos)
      << camera.problem();
  EXPECT_EQ(camera.status().state, CameraState::Closed);
}

TEST_F(Replay, GivesEachFrameOutWhenItsTimeHasCome) {
  record(3);
  ManualClock clock(5'000'000);
  start(clock);
  ASSERT_TRUE(wait_until(pool_, [&] { return pool_.published() == 1; }));
  EXPECT_EQ(pool_.lease_latest().frame().exposure_us, 5'000'000);
  clock.advance_us(test::kSmallInterval_us - 1);
  const std::uint32_t version = pool_.published_signal().version();
  // Twice the capture thread's longest sleep: it had its chance to be early.
  EXPECT_FALSE(pool_.published_signal().wait(version, 100'000));
  clock.advance_us(1);
  ASSERT_TRUE(wait_until(pool_, [&] { return pool_.published() == 2; }));
  EXPECT_EQ(pool_.lease_latest().frame().exposure_us, 5'000'000 + test::kSmallInterval_us);
}

TEST_F(Replay, StretchesTimeByTheFactor) {
  record(4);
  options_.factor = 4.0;
  start(real_time_);
  ASSERT_TRUE(wait_until(pool_, [&] { return pool_.published() == 4; }));
  const std::int64_t last_us = pool_.lease_latest().frame().exposure_us;
  const FrameLease first = pool_.lease_nearest(0);
  EXPECT_EQ(first.frame().sequence, 0u);
  EXPECT_EQ(last_us - first.frame().exposure_us, 3 * test::kSmallInterval_us / 4);
}

TEST_F(Replay, LeavesOutFramesThatAreTooLateAndCountsThem) {
  record(5);
  options_.loop = true;
  ManualClock clock(1);
  ReplayCamera& camera = start(clock);
  ASSERT_TRUE(wait_until(pool_, [&] { return pool_.published() == 1; }));
  clock.advance_us(10'000'000);
  ASSERT_TRUE(wait_until(pool_, [&] { return camera.status().counters.dropped > 0; }));
  ASSERT_TRUE(wait_until(
      pool_, [&] { return pool_.lease_latest().frame().exposure_us >= 10'000'001 - 250'000; }));
  camera.stop();
  const CameraCounters counters = camera.status().counters;
  EXPECT_EQ(counters.dropped, pool_.dropped());
  // Nothing is lost unsaid: every place in the sequence is a frame or a drop.
  EXPECT_EQ(pool_.lease_latest().frame().sequence + 1, counters.frames + counters.dropped);
}

TEST_F(Replay, EndsAtABadFrameAndSaysWhich) {
  record(4);
  std::filesystem::remove(folder_ / "r" / depth_file(2));
  const CameraStatus status = play_all();
  EXPECT_EQ(status.state, CameraState::Ended);
  EXPECT_EQ(status.code, Code::SensorNotConnected);
  EXPECT_EQ(status.counters.frames, 2u);
  EXPECT_NE(camera_->problem().find("frame 2: "), std::string::npos) << camera_->problem();
  EXPECT_NE(camera_->problem().find("can't be opened"), std::string::npos) << camera_->problem();
}

TEST_F(Replay, DropsABadFrameAndCountsItWhenToldTo) {
  record(4);
  std::filesystem::remove(folder_ / "r" / depth_file(2));
  options_.on_bad_frame = OnBadFrame::Drop;
  const CameraStatus status = play_all();
  EXPECT_EQ(status.code, Code::NoFrameInTime);
  EXPECT_EQ(status.counters.frames, 3u);
  EXPECT_EQ(status.counters.dropped, 1u);
  EXPECT_EQ(status.counters.bad_frames, 1u);
  EXPECT_EQ(pool_.dropped(), 1u);
  EXPECT_EQ(pool_.lease_latest().frame().sequence, 3u);
}

TEST_F(Replay, EndsALoopInWhichNoFrameCanBeRead) {
  record(3);
  for (std::size_t frame = 0; frame < 3; ++frame) {
    std::filesystem::remove(folder_ / "r" / depth_file(frame));
  }
  options_.on_bad_frame = OnBadFrame::Drop;
  options_.loop = true;
  const CameraStatus status = play_all();
  EXPECT_EQ(status.state, CameraState::Ended);
  EXPECT_EQ(status.counters.frames, 0u);
  EXPECT_NE(camera_->problem(), "");
}

TEST_F(Replay, SurvivesAnImageCutAtAnyByte) {
  record(3);
  const std::filesystem::path image = folder_ / "r" / depth_file(1);
  const std::vector<std::byte> whole = read_file(image, 1 << 20);
  options_.on_bad_frame = OnBadFrame::Drop;
  for (std::size_t size = 0; size < whole.size(); size += 3) {
    write_file(image, std::span(whole).first(size));
    const std::uint64_t before = pool_.published();
    const CameraStatus status = play_all();
    EXPECT_EQ(status.counters.bad_frames, 1u) << size;
    EXPECT_EQ(pool_.published() - before, 2u) << size;
    camera_.reset();
  }
}

TEST_F(Replay, SurvivesItsTextFilesCutAtAnyByte) {
  record(2);
  for (const char* name : {"camera.toml", "depth.txt", "rgb.txt"}) {
    const std::filesystem::path file = folder_ / "r" / name;
    const std::vector<std::byte> whole = read_file(file, 1 << 20);
    for (std::size_t size = 0; size < whole.size(); ++size) {
      write_file(file, std::span(whole).first(size));
      options_.mode = ReplayMode::Stepped;
      ReplayCamera& camera = make(real_time_);
      if (!camera.open().ok()) {
        EXPECT_NE(camera.problem().find(name == std::string("camera.toml") ? name : "r"),
                  std::string::npos);
        continue;
      }
      ASSERT_TRUE(camera.start(pool_, {}).ok());
      (void)camera.step();
    }
    write_file(file, std::span<const std::byte>(whole));
  }
}

TEST_F(Replay, SaysWhyARecordingCantBeOpened) {
  options_.path = (folder_ / "absent").string();
  ReplayCamera& camera = make(real_time_);
  const Result<CameraInfo> info = camera.open();
  ASSERT_FALSE(info.ok());
  EXPECT_EQ(info.error(), (Error{Code::SensorNotConnected, Stage::Recording, 0}));
  EXPECT_NE(camera.problem().find("absent: is not a recording"), std::string::npos);
}

TEST_F(Replay, StartsAgainAfterItsEnd) {
  record(2);
  play_all();
  ASSERT_TRUE(camera_->start(pool_, {}).ok());
  EXPECT_TRUE(wait_until(pool_, [&] { return pool_.published() == 4; }));
  EXPECT_EQ(pool_.lease_latest().frame().sequence, 3u);
}

TEST(PlaybackOrder, NeverRunsBackWhereTheTimestampsDo) {
  const test::TempFolder folder;
  test::write_small_recording(folder / "r", 3, false);
  const std::string index = "1700000000.000000 " + depth_file(0) + "\n1700000000.020000 " +
                            depth_file(1) + "\n1700000000.010000 " + depth_file(2) + "\n";
  write_file(folder / "r/depth.txt", std::string_view(index));
  ReplayOptions options;
  options.loop = true;
  const PlaybackOrder order(Recording::open(folder / "r"), options);
  for (std::uint64_t n = 1; n < 10; ++n) EXPECT_GT(order.offset_us(n), order.offset_us(n - 1));
  EXPECT_EQ(order.frame(4), 1u);
}

TEST(ReplayOptions, TakesThePathRelativeToTheConfiguration) {
  const ReplayOptions options = read_replay_options(parse_config(
      "driver = \"replay\"\npath = \"demo\"\nmode = \"fast\"\n", "/etc/g/grapnel.toml"));
  EXPECT_EQ(options.path, "/etc/g/demo");
  EXPECT_EQ(options.mode, ReplayMode::Fast);
  EXPECT_EQ(read_replay_options(parse_config("path = \"/data/r\"\n", "/etc/g/x.toml")).path,
            "/data/r");
}

TEST(ReplayOptions, RefusesWhatItDoesNotKnow) {
  const auto message_of = [](const std::string& text) {
    try {
      (void)read_replay_options(parse_config(text, "g.toml"));
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string("accepted");
  };
  EXPECT_EQ(message_of("mode = \"fast\"\n"), "g.toml:1: key \"path\" is missing");
  EXPECT_EQ(message_of("path = \"r\"\nlop = true\n"),
            "g.toml:2: lop: unknown key; did you mean \"loop\"?");
  EXPECT_EQ(
      message_of("path = \"r\"\nmode = \"real\"\n"),
      "g.toml:2: mode: \"real\" is not allowed; one of \"true_time\", \"fast\", \"stepped\" is");
  EXPECT_EQ(message_of("path = \"r\"\nfactor = 0\n"),
            "g.toml:2: factor: 0 is out of range; 0.01 to 100 is allowed");
}

}  // namespace
}  // namespace grapnel
