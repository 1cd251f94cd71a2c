#include "drivers/replay/frame_recorder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <string>
#include <thread>
#include <vector>

#include "base/clock.h"
#include "base/input_error.h"
#include "drivers/replay/image_file.h"
#include "drivers/replay/recording.h"
#include "tests/support/small_recording.h"
#include "tests/support/temp_folder.h"

namespace grapnel {
namespace {

constexpr int kWidth = test::kSmallWidth;
constexpr int kHeight = test::kSmallHeight;
constexpr std::size_t kPixels = std::size_t{kWidth} * kHeight;
constexpr std::int64_t kPatienceUs = 10'000'000;

/// A disk that is stopped and let go by the test, and may be full.
class HeldStore final : public RecordingStore {
 public:
  explicit HeldStore(const std::filesystem::path& folder) : store_(folder) {}
  std::atomic<bool> held{false};
  std::atomic<bool> full{false};
  void make_folder(const std::string& name) override { store_.make_folder(name); }
  void write(const std::string& name, std::span<const std::byte> bytes) override {
    while (held.load()) std::this_thread::yield();
    if (full.load()) throw InputError(name + ": no space left on device");
    store_.write(name, bytes);
  }
  void append(const std::string& name, std::string_view text) override {
    store_.append(name, text);
  }
  void sync() override {}
  [[nodiscard]] std::uint64_t free_bytes() const noexcept override { return ~std::uint64_t{0}; }

 private:
  FolderStore store_;
};

class FrameRecorderTest : public ::testing::Test {
 protected:
  void publish(std::size_t number) {
    FramePool::Slot* slot = pool_.begin_write();
    ASSERT_NE(slot, nullptr) << "the recorder keeps the camera from its memory";
    for (std::size_t i = 0; i < kPixels; ++i) {
      slot->depth[i] = test::small_depth(number, i);
      slot->color[i] = test::small_color(number, i);
    }
    slot->frame.depth = {slot->depth, kWidth, kHeight};
    slot->frame.color = {slot->color, kWidth, kHeight};
    slot->frame.intrinsics = test::small_camera().intrinsics();
    slot->frame.sequence = number;
    slot->frame.exposure_us = 1'000'000 + static_cast<std::int64_t>(number) * 33'333;
    pool_.publish(slot);
  }
  template <class Happened>
  bool eventually(Happened happened) const {
    const std::int64_t end_us = clock_.now_us() + kPatienceUs;
    while (!happened()) {
      if (clock_.now_us() > end_us) return false;
      clock_.sleep_until_us(clock_.now_us() + 1000);
    }
    return true;
  }

  MonotonicClock clock_;
  FramePool pool_{4, kWidth, kHeight, true};
  test::TempFolder folder_;
  HeldStore store_{folder_ / "r"};
};

TEST_F(FrameRecorderTest, RecordsEveryFrameAsItWas) {
  RecorderOptions options;
  options.serial = "UNIT7";
  FrameRecorder recorder(pool_, store_, clock_, options);
  recorder.start();
  for (std::size_t i = 0; i < 20; ++i) {
    publish(i);
    ASSERT_TRUE(eventually([&] { return recorder.counters().bytes > 0 && pool_.published() > i; }));
  }
  recorder.stop();
  const RecorderCounters counters = recorder.counters();
  const Recording recording = Recording::open(folder_ / "r");
  EXPECT_EQ(counters.recorded + counters.missed, 20U);
  ASSERT_EQ(recording.frame_count(), counters.recorded);
  EXPECT_EQ(recording.camera().serial, "UNIT7");
  std::vector<std::uint16_t> depth(kPixels);
  std::vector<Rgb8> color(kPixels);
  for (std::size_t i = 0; i < recording.frame_count(); ++i) {
    ASSERT_TRUE(recording.read_frame(i, depth, color));
    const std::size_t number = test::frame_shown({depth.data(), kWidth, kHeight});
    EXPECT_EQ(recording.time_us(i), 1'000'000 + static_cast<std::int64_t>(number) * 33'333);
    for (std::size_t k = 0; k < kPixels; ++k) {
      ASSERT_EQ(depth[k], test::small_depth(number, k));
      ASSERT_EQ(color[k], test::small_color(number, k));
    }
  }
}

TEST_F(FrameRecorderTest, ADiskThatStandsStillCostsFramesButNeverStopsTheCamera) {
  RecorderOptions options;
  options.queue_bytes = 1;  // one frame waits, no more
  FrameRecorder recorder(pool_, store_, clock_, options);
  recorder.start();
  store_.held = true;
  for (std::size_t i = 0; i < 200; ++i) publish(i);  // publish() fails when the pool is exhausted
  ASSERT_TRUE(eventually([&] { return recorder.counters().waiting_bytes > 0; }));
  for (std::size_t i = 200; i < 400; ++i) publish(i);
  store_.held = false;
  ASSERT_TRUE(eventually([&] { return recorder.counters().waiting_bytes == 0; }));
  recorder.stop();
  const RecorderCounters counters = recorder.counters();
  EXPECT_GT(counters.missed, 0U);
  EXPECT_EQ(Recording::open(folder_ / "r").frame_count(), counters.recorded);
}

TEST_F(FrameRecorderTest, AFullDiskIsCountedAndRecordingGoesOnWhenThereIsRoom) {
  FrameRecorder recorder(pool_, store_, clock_, {});
  recorder.start();
  publish(0);
  ASSERT_TRUE(eventually([&] { return recorder.counters().bytes > 0; }));
  store_.full = true;
  publish(1);
  ASSERT_TRUE(eventually([&] { return recorder.counters().dropped_disk == 1; }));
  EXPECT_NE(recorder.problem().find("no space"), std::string::npos);
  store_.full = false;
  publish(2);
  recorder.stop();
  EXPECT_EQ(recorder.counters().recorded, 2U);
  EXPECT_EQ(Recording::open(folder_ / "r").frame_count(), 2U);
}

TEST_F(FrameRecorderTest, LeavesRoomOnTheDiskForEverybodyElse) {
  FolderStore store(folder_ / "q");
  RecorderOptions options;
  options.min_free_bytes = ~std::uint64_t{0};
  FrameRecorder recorder(pool_, store, clock_, options);
  recorder.start();
  publish(0);
  recorder.stop();
  EXPECT_EQ(recorder.counters().dropped_disk, 1U);
  EXPECT_NE(recorder.problem().find("disk full"), std::string::npos);
}

TEST(PngEfforts, AreAllLossless) {
  std::vector<std::uint16_t> depth(kPixels);
  std::vector<Rgb8> color(kPixels);
  for (std::size_t i = 0; i < kPixels; ++i) {
    depth[i] = static_cast<std::uint16_t>(i * 40503U);
    color[i] = {static_cast<std::uint8_t>(i * 7), static_cast<std::uint8_t>(i * 31),
                static_cast<std::uint8_t>(i / 3)};
  }
  for (const PngEffort effort : {PngEffort::None, PngEffort::Fast, PngEffort::Small}) {
    EXPECT_EQ(
        decode_depth_png(encode_depth_png({depth.data(), kWidth, kHeight}, effort), "d").pixels,
        depth);
    EXPECT_EQ(
        decode_color_image(encode_color_png({color.data(), kWidth, kHeight}, effort), "c").pixels,
        color);
  }
}

TEST(Jpeg, KeepsSmoothColoursNearlyAndSaysTheyAreColours) {
  std::vector<Rgb8> color(kPixels);
  for (std::size_t i = 0; i < kPixels; ++i) {
    color[i] = {static_cast<std::uint8_t>(40 + 4 * (i % kWidth)),
                static_cast<std::uint8_t>(200 - 3 * (i / kWidth)), 90};
  }
  const ColorImage back =
      decode_color_image(encode_color_jpeg({color.data(), kWidth, kHeight}, 95), "c.jpg");
  ASSERT_EQ(back.pixels.size(), kPixels);
  int worst = 0;
  for (std::size_t i = 0; i < kPixels; ++i) {
    worst = std::max({worst, std::abs(back.pixels[i].r - color[i].r),
                      std::abs(back.pixels[i].g - color[i].g),
                      std::abs(back.pixels[i].b - color[i].b)});
  }
  EXPECT_LE(worst, 8);  // a smooth ramp holds few frequencies; quality 95 divides them by 1 to 6
}

}  // namespace
}  // namespace grapnel
