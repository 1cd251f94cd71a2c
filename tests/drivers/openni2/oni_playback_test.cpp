// Files of the genuine OpenNI recorder over the fake sensor, played by the genuine player in its
// child process. The time limit of each case is its watchdog.
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <array>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <memory>
#include <string>
#include <vector>

#include "base/clock.h"
#include "base/config.h"
#include "drivers/oni/oni_reader.h"
#include "drivers/registry.h"
#include "drivers/replay/recording.h"
#include "tests/support/fake_openni/sensor_file.h"

namespace grapnel::test {
namespace {

const std::string kBinaries = GRAPNEL_BINARY_DIR "/bin";
const std::string kPlayer = kBinaries + "/cameras/grapnel-oni-player";
constexpr std::size_t kPixels = std::size_t{kSensorWidth} * kSensorHeight;
constexpr std::int64_t kLook_us = 1'000'000;
constexpr int kFrames = 20;

class OniFile : public testing::Test {
 protected:
  void SetUp() override {
    sensor_.color = 1;
    sensor_.speed_up = 1;
    sensor_.color_skew_us = 400;
    for (auto* fault : {&sensor_.color_frozen, &sensor_.silent, &sensor_.skip_frames,
                        &sensor_.stuck_mirror, &sensor_.no_cropping}) {
      *fault = 0;
    }
    sensor_.plugged = 1;
  }
  /// Records the fake sensor; the file's name.
  std::string record(const std::string& how = "") {
    // The recording process ends without tidying up: what it counted of its own is taken back.
    const std::array<std::atomic<std::int32_t>*, 5> counts = {&sensor_.driver_up,
                                                              &sensor_.announced, &sensor_.opened,
                                                              &sensor_.streams, &sensor_.running};
    std::array<std::int32_t, 5> before{};
    for (std::size_t i = 0; i < counts.size(); ++i) before[i] = counts[i]->load();
    const std::string file = (folder_ / "scene.oni").string();
    const std::string command = kBinaries + "/grapnel-make-oni " + file + " " +
                                std::to_string(kFrames) + " " + how + " > /dev/null 2>&1";
    const int status = std::system(command.c_str());
    EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << status;
    for (std::size_t i = 0; i < counts.size(); ++i) *counts[i] = before[i];
    return file;
  }
  struct Played {
    std::vector<OniRecord> depth;
    std::vector<OniRecord> color;
    int wrong = 0;  ///< frames that are not the picture that was due
  };
  /// To the end; `between` is called after each frame of depth.
  template <class Between>
  Played play(OniReader& reader, Between between) {
    Played played;
    std::vector<std::byte> bytes;
    for (;;) {
      const std::optional<OniRecord> record = reader.next(kLook_us, bytes);
      if (!record) continue;
      if (record->kind == OniKind::End) return played;
      const bool depth = record->kind == OniKind::Depth;
      if (depth ? !is_due(bytes, depth_phase_) : !is_due_color(bytes)) ++played.wrong;
      (depth ? played.depth : played.color).push_back(*record);
      if (depth) between(played.depth.size());
    }
  }
  Played play(OniReader& reader) {
    return play(reader, [](std::size_t) {});
  }

  /// The sensor's pictures repeat after eight: each frame must be the next one.
  bool is_due(const std::vector<std::byte>& bytes, std::int64_t& phase) {
    std::vector<std::uint16_t> pixels(kPixels);
    std::memcpy(pixels.data(), bytes.data(), bytes.size());
    for (std::uint64_t n = 0; n < kSensorPictures; ++n) {
      bool same = true;
      for (std::size_t i = 0; same && i < kPixels; ++i) {
        const int u = static_cast<int>(i) % kSensorWidth;
        const int v = static_cast<int>(i) / kSensorWidth;
        same = pixels[i] == sensor_depth_mm(u, v, n);
      }
      if (!same) continue;
      const bool due = phase < 0 || (static_cast<std::uint64_t>(phase) + 1) % kSensorPictures == n;
      phase = static_cast<std::int64_t>(n);
      return due;
    }
    return false;
  }
  static bool is_due_color(const std::vector<std::byte>& bytes) {
    std::vector<Rgb8> pixels(kPixels);
    std::memcpy(pixels.data(), bytes.data(), bytes.size());
    const unsigned n = (pixels[0].b + kSensorPictures) % kSensorPictures;
    for (std::size_t i = 0; i < kPixels; ++i) {
      const int u = static_cast<int>(i) % kSensorWidth;
      const int v = static_cast<int>(i) / kSensorWidth;
      if (!(pixels[i] == sensor_color(u, v, n))) return false;
    }
    return true;
  }
  bool wait(const std::function<bool()>& done, double seconds) const {
    const std::int64_t until_us = clock_.now_us() + static_cast<std::int64_t>(seconds * 1e6);
    while (!done()) {
      if (clock_.now_us() > until_us) return false;
      clock_.sleep_until_us(clock_.now_us() + 2'000);
    }
    return true;
  }

  FakeSensor& sensor_ = fake_sensor();
  TempFolder folder_;
  MonotonicClock clock_;
  std::int64_t depth_phase_ = -1;
};

// The recorder leaves a tail of zeros behind, times and numbers begin anew, and each stream's
// frames come whole only if all streams are read.
TEST_F(OniFile, PlaysEveryFrameOfBothStreamsOnceAndBitForBit) {
  const std::string file = record();
  OniReader reader(kPlayer, file);
  EXPECT_EQ(reader.head().width, kSensorWidth);
  EXPECT_NEAR(reader.head().horizontal_fov_rad, double{kSensorHorizontalFov_rad}, 1e-6);
  const Played played = play(reader);
  EXPECT_EQ(played.wrong, 0);
  EXPECT_GE(played.depth.size(), kFrames - 1U);
  EXPECT_EQ(static_cast<std::int64_t>(played.depth.size()), reader.head().depth_frames);
  EXPECT_GE(played.color.size(), kFrames - 2U);
  for (std::size_t i = 0; i < played.depth.size(); ++i) {
    EXPECT_EQ(played.depth[i].index, static_cast<std::int64_t>(i) + 1);
    if (i > 0) {
      EXPECT_GT(played.depth[i].time_us, played.depth[i - 1].time_us);
    }
  }
  EXPECT_LT(played.depth.front().time_us, 100'000) << "from 0: the sensor's own time is lost";
}

// Its frame count is -1 then.
TEST_F(OniFile, ThatWasNotClosedIsPlayedToWhereItEnds) {
  OniReader reader(kPlayer, record("unclosed"));
  EXPECT_LT(reader.head().depth_frames, 0);
  const Played played = play(reader);
  EXPECT_EQ(played.wrong, 0);
  EXPECT_GE(played.depth.size(), kFrames / 2U);
}

// It opens and tells its number of frames, and no frame ever comes.
TEST_F(OniFile, OfADriverWithoutCroppingIsRefusedNotWaitedFor) {
  sensor_.no_cropping = 1;
  const std::string file = record();
  OniReader reader(kPlayer, file);
  try {
    (void)play(reader);
    FAIL() << "it was played";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("none of its frames can be played"), std::string::npos)
        << error.what();
  }
}

TEST_F(OniFile, ThatIsNoneIsRefusedInOneLine) {
  const std::string file = (folder_ / "text.oni").string();
  std::ofstream(file) << "this is no recording";
  try {
    OniReader reader(kPlayer, file);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_EQ(std::string(error.what()), file + ": is not a recording that OpenNI can play");
  }
  EXPECT_THROW(OniReader(kPlayer, folder_ / "absent.oni"), InputError);
}

// OpenNI's player crashes at random.
TEST_F(OniFile, GoesOnWhereItWasWhenThePlayerDies) {
  OniReader reader(kPlayer, record());
  const Played played = play(reader, [&](std::size_t frame) {
    if (frame == 3 || frame == 9) ::kill(reader.player(), SIGKILL);
  });
  EXPECT_EQ(played.wrong, 0);
  EXPECT_EQ(static_cast<std::int64_t>(played.depth.size()), reader.head().depth_frames);
  EXPECT_EQ(reader.losses(), 2);
}

TEST_F(OniFile, GoesOnWhereItWasWhenThePlayerHangs) {
  OniReader reader(kPlayer, record());
  const Played played = play(reader, [&](std::size_t frame) {
    if (frame == 5) ::kill(reader.player(), SIGSTOP);
  });
  EXPECT_EQ(played.wrong, 0);
  EXPECT_EQ(static_cast<std::int64_t>(played.depth.size()), reader.head().depth_frames);
  EXPECT_EQ(reader.losses(), 1);
}

TEST_F(OniFile, TriesAgainWhenAReplacementDiesBeforeItPlays) {
  // Every second player ends at once.
  const std::string count = (folder_ / "players").string();
  const std::filesystem::path player = folder_ / "player.sh";
  std::ofstream(player) << "#!/bin/sh\necho >>" << count << "\n[ $(($(wc -l <" << count
                        << ") % 2)) = 0 ] && exit 1\nexec " << kPlayer << " \"$@\"\n";
  std::filesystem::permissions(player, std::filesystem::perms::owner_all);
  OniReader reader(player, record());
  const Played played = play(reader, [&](std::size_t frame) {
    if (frame == 3) ::kill(reader.player(), SIGKILL);
  });
  EXPECT_EQ(static_cast<std::int64_t>(played.depth.size()), reader.head().depth_frames);
  EXPECT_EQ(reader.losses(), 2);
}

TEST_F(OniFile, GivesUpWithOneLineWhenNoPlayerGetsFurther) {
  EXPECT_THROW(OniReader("/bin/true", record()), OniPlayerLost);
}

TEST_F(OniFile, IsImportedFrameByFrame) {
  const std::string file = record();
  const std::string recording = (folder_ / "imported").string();
  const std::string command =
      kBinaries + "/grapnel import " + file + " -o " + recording + " --json > /dev/null";
  ASSERT_EQ(std::system(command.c_str()), 0);
  const Recording read = Recording::open(recording);
  EXPECT_GE(read.frame_count(), kFrames - 1U);
  std::vector<std::uint16_t> depth(kPixels);
  for (std::size_t i = 0; i < read.frame_count(); ++i) {
    read.read_frame(i, depth, {});
    std::vector<std::byte> bytes(2 * kPixels);
    std::memcpy(bytes.data(), depth.data(), bytes.size());
    EXPECT_TRUE(is_due(bytes, depth_phase_)) << i;
  }
}

TEST_F(OniFile, FrameIsAnInputWithoutAnImport) {
  const std::string file = record();
  const auto run = [&](const std::string& command) {
    return std::system((kBinaries + "/grapnel " + command + " > /dev/null").c_str());
  };
  const std::string recording = (folder_ / "imported").string();
  ASSERT_EQ(run("import " + file + " -o " + recording), 0);
  const auto cloud = [&](const std::string& input, const std::string& name) {
    const std::string output = (folder_ / name).string();
    EXPECT_EQ(run("filter " + input + " --method median -o " + output), 0);
    std::ifstream stream(output, std::ios::binary);
    return std::string(std::istreambuf_iterator<char>(stream), {});
  };
  const std::string imported = cloud(recording + "#5", "a.pcd");
  EXPECT_GT(imported.size(), 1000U);
  EXPECT_TRUE(cloud(file + "#5", "b.pcd") == imported);
  EXPECT_FALSE(cloud(file + "#6", "c.pcd") == imported);
  EXPECT_EQ(WEXITSTATUS(run("filter " + file + "#99 --method median -o " +
                            (folder_ / "d.pcd").string() + " 2> /dev/null")),
            2);
}

class OniCamera : public OniFile {
 protected:
  void start(const std::string& options) {
    camera_ =
        make_camera(parse_config("driver = \"openni2\"\nplugins = \"" + kBinaries +
                                     "/cameras\"\nrecording = \"" + record() + "\"\n" + options,
                                 "g.toml"),
                    clock_);
    const Result<CameraInfo> info = camera_->open();
    ASSERT_TRUE(info.ok()) << camera_->problem();
    EXPECT_FALSE(info.value().live);
    ASSERT_TRUE(camera_->start(pool_, {}).ok());
  }
  void TearDown() override { camera_.reset(); }
  bool in_state(CameraState state, double seconds) const {
    return wait([&] { return camera_->status().state == state; }, seconds);
  }
  /// The player that this process has started last.
  static pid_t player() {
    pid_t found = -1;
    for (const auto& entry : std::filesystem::directory_iterator("/proc/self/task")) {
      std::ifstream children(entry.path() / "children");
      pid_t child = -1;
      while (children >> child) {
        std::string name;
        std::getline(std::ifstream("/proc/" + std::to_string(child) + "/comm"), name);
        if (name == "grapnel-oni-pla") found = child;
      }
    }
    return found;
  }

  FramePool pool_{4, kSensorWidth, kSensorHeight, true};
  std::unique_ptr<Camera> camera_;
};

TEST_F(OniCamera, PlaysAtItsOwnPaceAndSaysThatItHasEnded) {
  const std::int64_t from_us = clock_.now_us();
  start("");
  bool coloured = false;
  const bool ended = wait(
      [&] {
        const FrameLease frame = pool_.lease_latest();
        coloured = coloured || (frame.valid() && !frame.frame().color.empty());
        return camera_->status().state == CameraState::Ended;
      },
      10.0);
  EXPECT_TRUE(ended);
  EXPECT_TRUE(coloured);
  EXPECT_EQ(camera_->status().code, Code::SensorHealthy);
  EXPECT_GT(clock_.now_us() - from_us, (kFrames - 3) * 33'333);
  EXPECT_GE(pool_.published(), kFrames - 4U);
  const FrameLease last = pool_.lease_latest();
  EXPECT_TRUE(last.frame().recorded);
  clock_.sleep_until_us(clock_.now_us() + 1'500'000);
  EXPECT_EQ(camera_->status().state, CameraState::Ended) << "nobody waits for more frames";
}

TEST_F(OniCamera, PlaysOverAndOverWithNumbersThatGoOn) {
  start("loop = true");
  ASSERT_TRUE(wait([&] { return pool_.published() > 2 * kFrames + 5; }, 20.0));
  EXPECT_EQ(camera_->status().state, CameraState::Streaming);
  EXPECT_GT(pool_.lease_latest().frame().sequence, 2U * kFrames);
  EXPECT_EQ(camera_->status().counters.reconnects, 0U);
}

TEST_F(OniCamera, OutlivesItsPlayerKilledOrHung) {
  start("loop = true");
  for (const int fate : {SIGKILL, SIGSTOP, SIGSEGV}) {
    ASSERT_TRUE(wait([&] { return player() > 0; }, 5.0));
    const std::uint64_t before = pool_.published();
    ASSERT_TRUE(wait([&] { return pool_.published() > before + 2; }, 10.0));
    ::kill(player(), fate);
    const std::uint64_t after = pool_.published();
    EXPECT_TRUE(wait([&] { return pool_.published() > after + 10; }, 15.0)) << fate;
    EXPECT_TRUE(in_state(CameraState::Streaming, 5.0)) << fate;
  }
}

TEST_F(OniCamera, WithoutItsFileIsNoCamera) {
  camera_ = make_camera(parse_config("driver = \"openni2\"\nplugins = \"" + kBinaries +
                                         "/cameras\"\nrecording = \"/absent.oni\"\n",
                                     "g.toml"),
                        clock_);
  EXPECT_FALSE(camera_->open().ok());
  EXPECT_EQ(camera_->problem(), "/absent.oni: is not there");
}

}  // namespace
}  // namespace grapnel::test
