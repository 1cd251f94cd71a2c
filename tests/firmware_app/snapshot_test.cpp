#include "firmware_app/snapshot.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <fstream>
#include <optional>
#include <string>
#include <vector>

#include "base/file.h"
#include "base/input_error.h"
#include "firmware_app/snapshot_keeper.h"
#include "tests/firmware_app/fakes.h"

namespace grapnel {
namespace {

constexpr int kWidth = 8;
constexpr int kHeight = 6;
constexpr std::size_t kPixels = std::size_t{kWidth} * kHeight;

class SnapshotTest : public ::testing::Test {
 protected:
  SnapshotTest() {
    for (std::size_t i = 0; i < kPixels; ++i) {
      depth_[i] = static_cast<std::uint16_t>(900 + 37 * i);
      belt_[i] = static_cast<std::uint16_t>(65535 - i);
      color_[i] = {static_cast<std::uint8_t>(i), 7, static_cast<std::uint8_t>(255 - i)};
    }
    evidence_.job = 41;
    evidence_.command.part_tag = 0xfeedf00d;
    evidence_.result.code = Code::BelowFitness;
    DepthFrame& frame = evidence_.frame;
    frame.depth = {depth_.data(), kWidth, kHeight};
    frame.color = {color_.data(), kWidth, kHeight};
    frame.intrinsics = {kWidth, kHeight, 525.0 / 7.0, 524.9, 3.1, 2.7};
    frame.metres_per_unit = 0.001 / 3.0;
    frame.sequence = 123456789012345;
    JobContext& context = evidence_.context;
    context.model_mask = 0x80000001U;
    context.max_objects = 3;
    context.has_last_pick = true;
    context.last_pick.translation() = Vec3d(0.1, -0.0, 1.0 / 3.0);
    context.background.depth = {belt_.data(), kWidth, kHeight};
    context.background.has_plane = true;
    context.background.plane_normal = Vec3d(-0.0, 1e-17, -1.0);
    context.background.plane_offset_m = 1.1;
  }
  [[nodiscard]] Snapshot snapshot() const {
    Snapshot snapshot;
    snapshot.evidence = evidence_;
    snapshot.preset = {"active_preset = 11\n", "11-box.toml", "# a \"quoted\" text\n",
                       {"roi=\"x\\y\""},       "/m",          {{"box", 0xfedcba9876543210U}}};
    snapshot.build = "0.1.0-abc";
    snapshot.simd = "AVX2";
    snapshot.log = "one\ntwo\n";
    snapshot.report = "code 1009\n";
    return snapshot;
  }

  test::TemporaryFolder folder_;
  std::vector<std::uint16_t> depth_ = std::vector<std::uint16_t>(kPixels);
  std::vector<std::uint16_t> belt_ = std::vector<std::uint16_t>(kPixels);
  std::vector<Rgb8> color_ = std::vector<Rgb8>(kPixels);
  JobEvidence evidence_;
};

bool same_bits(const Pose& a, const Pose& b) {
  for (int i = 0; i < 16; ++i) {
    const auto left = std::bit_cast<std::uint64_t>(a.matrix()(i / 4, i % 4));
    if (left != std::bit_cast<std::uint64_t>(b.matrix()(i / 4, i % 4))) return false;
  }
  return true;
}

TEST_F(SnapshotTest, BringsBackEveryBitThatAJobDependsOn) {
  const std::filesystem::path file = folder_.path() / "a.snapshot";
  write_snapshot(file, snapshot());
  const Snapshot back = read_snapshot(file);
  const JobEvidence& job = back.evidence;
  EXPECT_EQ(back.depth, depth_);
  EXPECT_EQ(back.background, belt_);
  EXPECT_EQ(back.color, color_);
  EXPECT_EQ(job.frame.depth.data, back.depth.data());
  EXPECT_EQ(job.context.background.depth.data, back.background.data());
  EXPECT_EQ(job.frame.metres_per_unit, 0.001 / 3.0);
  EXPECT_EQ(job.frame.intrinsics.fx, 525.0 / 7.0);
  EXPECT_EQ(job.frame.intrinsics.width, kWidth);
  EXPECT_EQ(job.frame.sequence, 123456789012345U);
  EXPECT_EQ(job.context.model_mask, 0x80000001U);
  EXPECT_EQ(job.context.max_objects, 3);
  EXPECT_TRUE(same_bits(job.context.last_pick, evidence_.context.last_pick));
  EXPECT_TRUE(std::signbit(job.context.background.plane_normal.x()));
  EXPECT_EQ(job.context.background.plane_normal.y(), 1e-17);
  EXPECT_EQ(back.preset.overrides, snapshot().preset.overrides);
  EXPECT_EQ(back.preset.text, snapshot().preset.text);
  ASSERT_EQ(back.preset.models.size(), 1U);
  EXPECT_EQ(back.preset.models[0].hash, 0xfedcba9876543210U);
  EXPECT_EQ(back.report, "code 1009\n");
  EXPECT_EQ(back.log, "one\ntwo\n");
}

TEST_F(SnapshotTest, RefusesADamagedFile) {
  const std::filesystem::path file = folder_.path() / "a.snapshot";
  write_snapshot(file, snapshot());
  std::vector<std::byte> bytes = read_file(file, 1U << 20);
  bytes[bytes.size() / 2] ^= std::byte{1};
  write_file(file, bytes);
  EXPECT_THROW((void)read_snapshot(file), InputError);
  EXPECT_THROW((void)read_snapshot(folder_.path() / "none.snapshot"), InputError);
}

class SnapshotKeeperTest : public SnapshotTest {
 protected:
  SnapshotKeeperTest() : memory_(64 * 1024) {
    Arena arena(memory_.span());
    slot_.reserve(arena, kWidth, kHeight, true);
  }
  std::unique_ptr<SnapshotKeeper> keeper(int keep) {
    return std::make_unique<SnapshotKeeper>(
        SnapshotKeeper::Parts{&slot_, [](std::uint32_t) { return std::optional<PresetOrigin>(); },
                              [this](const std::string& line) { complaints_.push_back(line); }},
        SnapshotKeeper::Facts{folder_.path() / "snapshots", keep, "build", "simd"});
  }
  void save(SnapshotKeeper& keeper, std::uint32_t job) {
    evidence_.job = job;
    ASSERT_TRUE(slot_.put(evidence_));
    ASSERT_TRUE(keeper.save_next());
  }
  [[nodiscard]] std::vector<std::string> names() const {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(folder_.path() / "snapshots")) {
      names.push_back(entry.path().filename().string().substr(0, 8));
    }
    std::sort(names.begin(), names.end());
    return names;
  }

  MemoryBlock memory_;
  EvidenceSlot slot_;
  std::vector<std::string> complaints_;
};

TEST_F(SnapshotKeeperTest, KeepsTheNewestAndCountsOnOverARestart) {
  auto first = keeper(3);
  for (std::uint32_t job = 1; job <= 5; ++job) save(*first, job);
  EXPECT_EQ(names(), (std::vector<std::string>{"00000003", "00000004", "00000005"}));
  auto second = keeper(3);
  save(*second, 1);
  EXPECT_EQ(names(), (std::vector<std::string>{"00000004", "00000005", "00000006"}));
}

TEST_F(SnapshotKeeperTest, ALabelReplacesTheSameJobsFile) {
  auto all = keeper(9);
  save(*all, 7);
  evidence_.label = GraspLabel::Good;
  save(*all, 7);
  EXPECT_EQ(names().size(), 1U);
}

TEST_F(SnapshotKeeperTest, ADiskThatRefusesIsToldAndTheNextJobIsTaken) {
  folder_.write("snapshots", "a file where the folder should be");
  auto all = keeper(9);
  save(*all, 1);
  save(*all, 2);
  EXPECT_EQ(complaints_.size(), 2U);
}

TEST_F(SnapshotKeeperTest, TheSlotIsNotOverwrittenWhileItIsSaved) {
  ASSERT_TRUE(slot_.put(evidence_));
  evidence_.job = 99;
  EXPECT_FALSE(slot_.put(evidence_));
  EXPECT_EQ(slot_.peek()->job, 41U);
}

}  // namespace
}  // namespace grapnel
