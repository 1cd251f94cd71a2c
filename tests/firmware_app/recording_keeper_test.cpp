#include "firmware_app/recording_keeper.h"

#include <gtest/gtest.h>

#include <fstream>
#include <optional>
#include <string>
#include <vector>

#include "drivers/replay/recording.h"
#include "tests/support/small_recording.h"
#include "tests/support/temp_folder.h"

namespace grapnel {
namespace {

namespace fs = std::filesystem;

constexpr int kWidth = test::kSmallWidth;
constexpr int kHeight = test::kSmallHeight;
constexpr std::int64_t kPatienceUs = 10'000'000;

/// The camera and the field bus are the test; step() is called as the keeper's thread would.
class RecordingKeeperTest : public ::testing::Test {
 protected:
  RecordingKeeperTest() {
    settings_.color = RecordColor::None;
    settings_.min_free_mb = 1;
  }
  void build() {
    keeper_.emplace(
        RecordingKeeper::Parts{&exchange_, &pool_, &clock_, [] { return std::string("UNIT7"); },
                               [this](LogLevel, const std::string& line) { said_ += line + "\n"; }},
        settings_, folder_ / "recordings");
  }
  Code send(RecordAction action, std::uint32_t part_tag = 0) {
    exchange_.request.publish({++number_, action, part_tag});
    keeper_->step();
    exchange_.state.update();
    EXPECT_EQ(exchange_.state.get().answered, number_);
    return exchange_.state.get().answer;
  }
  const RecordState& state() {
    keeper_->step();
    exchange_.state.update();
    return exchange_.state.get();
  }
  void publish() {
    FramePool::Slot* slot = pool_.begin_write();
    ASSERT_NE(slot, nullptr);
    for (std::size_t i = 0; i < std::size_t{kWidth} * kHeight; ++i) {
      slot->depth[i] = test::small_depth(sequence_, i);
    }
    slot->frame.depth = {slot->depth, kWidth, kHeight};
    slot->frame.intrinsics = test::small_camera().intrinsics();
    slot->frame.sequence = sequence_++;
    slot->frame.exposure_us = clock_.now_us();
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
  std::vector<fs::path> recordings() const {
    std::vector<fs::path> found;
    std::error_code none;
    for (const auto& entry : fs::directory_iterator(folder_ / "recordings", none)) {
      found.push_back(entry.path());
    }
    return found;
  }

  MonotonicClock clock_;
  FramePool pool_{4, kWidth, kHeight, false};
  test::TempFolder folder_;
  RecordExchange exchange_;
  RecordingSettings settings_;
  std::optional<RecordingKeeper> keeper_;
  std::string said_;
  std::uint32_t number_ = 0;
  std::uint64_t sequence_ = 0;
};

TEST_F(RecordingKeeperTest, WhatWasPublishedBetweenBeginAndEndIsInARecordingNamedByThePart) {
  build();
  ASSERT_EQ(send(RecordAction::Begin, 0xbeef), Code::CaptureDone);
  EXPECT_EQ(exchange_.state.get().phase, PlcRecording::Running);
  for (std::uint32_t i = 1; i <= 5; ++i) {
    publish();
    ASSERT_TRUE(eventually([&] { return state().frames + state().missed == i; }));
  }
  ASSERT_EQ(send(RecordAction::End), Code::CaptureDone);
  EXPECT_EQ(exchange_.state.get().phase, PlcRecording::None);
  ASSERT_EQ(recordings().size(), 1U);
  EXPECT_EQ(recordings()[0].filename(), "00000001-tag0000beef");
  const Recording recording = Recording::open(recordings()[0]);
  EXPECT_EQ(recording.frame_count(), 5U);
  EXPECT_EQ(recording.camera().serial, "UNIT7");
  EXPECT_EQ(state().frames, 5U) << "the last recording's counters stay";
}

TEST_F(RecordingKeeperTest, ASecondBeginIsBusyAndAnEndWithoutBeginIsNoParameter) {
  build();
  EXPECT_EQ(send(RecordAction::End), Code::BadParameter);
  ASSERT_EQ(send(RecordAction::Begin), Code::CaptureDone);
  EXPECT_EQ(send(RecordAction::Begin), Code::Busy);
  EXPECT_EQ(state().phase, PlcRecording::Running) << "the first one goes on";
  EXPECT_EQ(send(RecordAction::End), Code::CaptureDone);
  ASSERT_EQ(send(RecordAction::Begin), Code::CaptureDone);
  EXPECT_EQ(send(RecordAction::End), Code::CaptureDone);
  EXPECT_EQ(recordings().size(), 2U);
}

TEST_F(RecordingKeeperTest, AFullDiskIsRefusedAtOnceAndLeavesNothing) {
  settings_.min_free_mb = 100'000'000;
  build();
  EXPECT_EQ(send(RecordAction::Begin), Code::DiskFull);
  EXPECT_EQ(state().phase, PlcRecording::None);
  EXPECT_TRUE(recordings().empty());
  EXPECT_NE(said_.find("recording.min_free_mb"), std::string::npos) << said_;
}

TEST_F(RecordingKeeperTest, AFolderThatCannotBeMadeIsRefusedWithItsName) {
  std::ofstream(folder_ / "recordings") << "a file where the folder belongs";
  build();
  EXPECT_EQ(send(RecordAction::Begin), Code::DiskFull);
  EXPECT_NE(said_.find("recordings"), std::string::npos) << said_;
}

TEST_F(RecordingKeeperTest, ARecordingEndsByItselfAtItsLongest) {
  settings_.max_seconds = 1;
  build();
  ASSERT_EQ(send(RecordAction::Begin), Code::CaptureDone);
  publish();
  EXPECT_TRUE(eventually([&] { return state().phase == PlcRecording::None; }));
  EXPECT_EQ(Recording::open(recordings()[0]).frame_count(), 1U);
}

TEST_F(RecordingKeeperTest, StoppingTheDaemonKeepsWhatWasRecorded) {
  build();
  ASSERT_TRUE(keeper_->start());
  exchange_.request.publish({++number_, RecordAction::Begin, 0});
  exchange_.wake.notify();
  ASSERT_TRUE(eventually([&] {
    exchange_.state.update();
    return exchange_.state.get().phase == PlcRecording::Running;
  }));
  publish();
  keeper_->stop();
  EXPECT_EQ(Recording::open(recordings()[0]).frame_count(), 1U);
}

}  // namespace
}  // namespace grapnel
