#include "drivers/replay/durable_recording.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "base/file.h"
#include "base/input_error.h"
#include "drivers/replay/image_file.h"
#include "drivers/replay/recording.h"
#include "tests/drivers/replay/power_switch.h"
#include "tests/support/small_recording.h"
#include "tests/support/temp_folder.h"

namespace grapnel {
namespace {

constexpr std::size_t kPixels = std::size_t{test::kSmallWidth} * test::kSmallHeight;
constexpr std::int64_t kFrameUs = 33'333;
constexpr std::int64_t kLossUs = 1'000'000;
constexpr std::size_t kFrames = 75;

/// A disk that loses its power at the n-th call and is the worst that a cut allows: of a file that
/// was written after the last sync only half is there, of a text added after it only half.
class CutStore final : public RecordingStore {
 public:
  CutStore(const std::filesystem::path& folder, int calls) : store_(folder), folder_(folder) {
    left_ = calls;
  }
  void make_folder(const std::string& name) override {
    if (goes_on()) store_.make_folder(name);
  }
  void write(const std::string& name, std::span<const std::byte> bytes) override {
    const bool whole = goes_on();
    if (!whole && cut_) return;
    if (!whole) {
      write_file(folder_ / (name + ".part"), bytes.first(bytes.size() / 2));
      lose_power();
      return;
    }
    store_.write(name, bytes);
    unsynced_.insert_or_assign(name, 0);
  }
  void append(const std::string& name, std::string_view text) override {
    const bool whole = goes_on();
    if (!whole && cut_) return;
    const std::filesystem::path file = folder_ / name;
    std::error_code none;
    const std::uintmax_t before = std::filesystem::exists(file) ? file_size(file, none) : 0;
    store_.append(name, whole ? text : text.substr(0, text.size() / 2));
    if (!whole) {
      lose_power();
    } else {
      unsynced_.try_emplace(name, before);
    }
  }
  void sync() override {
    if (goes_on()) {
      unsynced_.clear();
    } else if (!cut_) {
      lose_power();
    }
  }
  [[nodiscard]] std::uint64_t free_bytes() const noexcept override { return store_.free_bytes(); }
  [[nodiscard]] bool cut() const { return cut_; }

 private:
  bool goes_on() { return !cut_ && left_-- > 0; }
  void lose_power() {
    cut_ = true;
    for (const auto& [name, kept] : unsynced_) {
      const std::filesystem::path file = folder_ / name;
      const std::uintmax_t size = std::filesystem::file_size(file);
      std::filesystem::resize_file(file, kept + (size - kept) / 2);
    }
  }

  FolderStore store_;
  std::filesystem::path folder_;
  std::map<std::string, std::uintmax_t> unsynced_;  // bytes that are safe
  int left_ = 0;
  bool cut_ = false;
};

std::vector<std::byte> depth_png(std::size_t frame) {
  std::vector<std::uint16_t> depth(kPixels);
  for (std::size_t i = 0; i < kPixels; ++i) depth[i] = test::small_depth(frame, i);
  return encode_depth_png({depth.data(), test::kSmallWidth, test::kSmallHeight});
}

std::vector<std::byte> color_png(std::size_t frame) {
  std::vector<Rgb8> color(kPixels);
  for (std::size_t i = 0; i < kPixels; ++i) color[i] = test::small_color(frame, i);
  return encode_color_png({color.data(), test::kSmallWidth, test::kSmallHeight});
}

using EncodedImages = std::pair<std::vector<std::byte>, std::vector<std::byte>>;

/// Depth and colour of each frame.
const std::vector<EncodedImages>& encoded_frames() {
  static const auto kEncoded = [] {
    std::vector<EncodedImages> all;
    for (std::size_t i = 0; i < kFrames; ++i) all.emplace_back(depth_png(i), color_png(i));
    return all;
  }();
  return kEncoded;
}

/// Records 2.5 s at 30 Hz; the frame at which the power went, kFrames when it stayed.
std::size_t record(CutStore& store) {
  const std::vector<EncodedImages>& encoded = encoded_frames();
  DurableRecording recording(store, test::small_camera());
  for (std::size_t i = 0; i < kFrames; ++i) {
    const std::int64_t now_us = static_cast<std::int64_t>(i) * kFrameUs;
    recording.add({test::kSmallStart_us + now_us, encoded[i].first, encoded[i].second, ".png"});
    recording.flush_if_due(now_us);
    if (store.cut()) return i;
  }
  recording.flush();
  return kFrames;
}

/// Frames that can be read, each checked against what was recorded.
std::size_t readable_frames(const std::filesystem::path& folder) {
  const Recording recording = Recording::open(folder);
  std::vector<std::uint16_t> depth(kPixels);
  std::vector<Rgb8> color(kPixels);
  for (std::size_t i = 0; i < recording.frame_count(); ++i) {
    EXPECT_TRUE(recording.read_frame(i, depth, color)) << "frame " << i << " has no colour";
    EXPECT_EQ(test::frame_shown({depth.data(), test::kSmallWidth, test::kSmallHeight}), i);
    EXPECT_EQ(color[5], test::small_color(i, 5));
  }
  return recording.frame_count();
}

/// Of a recording under a second old.
bool holds_a_frame(const std::filesystem::path& folder) {
  const std::filesystem::path index = folder / "depth.txt";
  return std::filesystem::exists(index) && !read_index(index).empty();
}

TEST(DurableRecording, LacksAtMostTheLastSecondWhereverThePowerIsCut) {
  for (int calls = 4;; ++calls) {
    SCOPED_TRACE("cut at call " + std::to_string(calls));
    const test::TempFolder folder;
    CutStore store(folder / "r", calls);
    const std::size_t at = record(store);
    if (!store.cut()) {
      EXPECT_EQ(readable_frames(folder / "r"), kFrames);
      EXPECT_GT(calls, 150) << "two images a frame were written";
      return;
    }
    const auto lost_frames = static_cast<std::size_t>(kLossUs / kFrameUs);
    if (at <= lost_frames) {
      // Under a second old: it need not hold a frame, but must not name a broken one.
      if (read_index(folder / "r" / "depth.txt").empty()) continue;
    }
    EXPECT_GE(readable_frames(folder / "r") + lost_frames, at);
    if (::testing::Test::HasFailure()) return;
  }
}

/// Records 1.3 s into a folder; the frame at which the power went.
std::size_t record_until_cut(const std::filesystem::path& folder, const test::PowerSwitch& power) {
  constexpr std::size_t kShort = 40;
  std::size_t at = 0;
  try {
    FolderStore store(folder);
    DurableRecording recording(store, test::small_camera());
    for (; at < kShort; ++at) {
      const std::int64_t now_us = static_cast<std::int64_t>(at) * kFrameUs;
      const auto& [depth, color] = encoded_frames()[at];
      recording.add({test::kSmallStart_us + now_us, depth, color, ".png"});
      recording.flush_if_due(now_us);
      if (power.cut()) return at;
    }
    recording.flush();
  } catch (const InputError&) {
    EXPECT_TRUE(power.cut());
  }
  return at;
}

// The same on a real folder, after each call of write, rename, fsync and syncfs that the recorder
// makes.
TEST(DurableRecording, IsReadableAfterACutBehindEachOfItsSystemCalls) {
  using Loss = test::PowerSwitch::Loss;
  std::map<std::string, int> cuts;
  for (int calls = 1;; ++calls) {
    for (const Loss loss : {Loss::Names, Loss::Data, Loss::Nothing}) {
      // The worst behind each call, what is milder behind some.
      if (loss != Loss::Names && calls % 4 != 0) continue;
      const test::TempFolder folder;
      test::PowerSwitch power(folder / "r", calls);
      const std::size_t at = record_until_cut(folder / "r", power);
      if (!power.cut()) {
        EXPECT_GT(cuts["write"], 80);
        EXPECT_GT(cuts["rename"], 80) << "two images a frame";
        EXPECT_GT(cuts["syncfs"], 4);
        return;
      }
      ++cuts[power.last_call()];
      SCOPED_TRACE("cut after call " + std::to_string(calls) + ", " + power.last_call());
      power.lose(loss);
      const auto lost_frames = static_cast<std::size_t>(kLossUs / kFrameUs);
      if (at <= lost_frames && !holds_a_frame(folder / "r")) continue;
      EXPECT_GE(readable_frames(folder / "r") + lost_frames, at);
      if (::testing::Test::HasFailure()) return;
    }
  }
}

TEST(DurableRecording, KeepsTheIndexWholeOverADiskThatIsFullForAWhile) {
  class FullStore final : public RecordingStore {
   public:
    explicit FullStore(const std::filesystem::path& folder) : store_(folder) {}
    bool full = false;
    void make_folder(const std::string& name) override { store_.make_folder(name); }
    void write(const std::string& name, std::span<const std::byte> bytes) override {
      refuse();
      store_.write(name, bytes);
    }
    void append(const std::string& name, std::string_view text) override {
      refuse();
      store_.append(name, text);
    }
    void sync() override { store_.sync(); }
    [[nodiscard]] std::uint64_t free_bytes() const noexcept override { return 0; }

   private:
    void refuse() const {
      if (full) throw InputError("disk full");
    }
    FolderStore store_;
  };
  const test::TempFolder folder;
  FullStore store(folder / "r");
  DurableRecording recording(store, test::small_camera());
  const auto add = [&](std::size_t i) {
    const auto time_us = test::kSmallStart_us + static_cast<std::int64_t>(i) * kFrameUs;
    recording.add({time_us, depth_png(i), color_png(i), ".png"});
  };
  add(0);
  store.full = true;
  EXPECT_THROW(recording.flush(), InputError);
  EXPECT_THROW(add(1), InputError);
  EXPECT_EQ(recording.flushed(), 0U);
  store.full = false;
  add(1);
  recording.flush();
  EXPECT_EQ(recording.flushed(), 2U);
  EXPECT_EQ(readable_frames(folder / "r"), 2U);
}

TEST(FolderStore, RefusesAFolderThatHoldsARecording) {
  const test::TempFolder folder;
  test::write_small_recording(folder / "r", 1, false);
  EXPECT_THROW(FolderStore store(folder / "r"), InputError);
}

}  // namespace
}  // namespace grapnel
