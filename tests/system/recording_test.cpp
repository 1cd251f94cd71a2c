#include <gtest/gtest.h>

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <vector>

#include "drivers/modbus/registers.h"
#include "drivers/replay/recording.h"
#include "tests/system/daemon_process.h"

namespace grapnel {
namespace {

namespace fs = std::filesystem;

constexpr int diagnostic_of(std::size_t address) {
  return static_cast<int>(address - registers::diagnostics::kFrames) / 2;
}
constexpr int kDropped = diagnostic_of(registers::diagnostics::kDroppedFrames);
constexpr int kHeapCalls = diagnostic_of(registers::diagnostics::kHeapCalls);
constexpr int kRecordFrames = diagnostic_of(registers::diagnostics::kRecordFrames);
constexpr int kRecordMissed = diagnostic_of(registers::diagnostics::kRecordMissed);

std::vector<fs::path> recordings_of(const test::Site& site) {
  std::vector<fs::path> folders;
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(site.folder() / "state" / "recordings", none)) {
    folders.push_back(entry.path());
  }
  std::sort(folders.begin(), folders.end());
  return folders;
}

Code code_of(const PlcAnswer& answer) { return answer.reading.result.code; }

TEST(Recording, ThePlcRecordsWhileJobsRunAndCaptureLosesNothing) {
  const test::Site site;
  test::DaemonProcess daemon(site);
  ASSERT_TRUE(daemon.wait_ready());
  test::Plc plc(daemon.port());
  EXPECT_EQ(code_of(plc.send(PlcCommandCode::RecordEnd)), Code::BadParameter);
  PlcCommand command;
  command.part_tag = 0xcafe;
  ASSERT_EQ(code_of(plc.send(PlcCommandCode::RecordBegin, command)), Code::CaptureDone);
  EXPECT_EQ(plc.status().recording, PlcRecording::Running);
  EXPECT_EQ(code_of(plc.send(PlcCommandCode::RecordBegin)), Code::Busy);
  command.timeout_ms = 20000;
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(code_of(plc.send(PlcCommandCode::Register, command)), Code::ObjectFound);
  }
  ASSERT_TRUE(test::eventually([&] { return plc.diagnostic(kRecordFrames) >= 10; }));
  ASSERT_EQ(code_of(plc.send(PlcCommandCode::RecordEnd)), Code::CaptureDone);
  ASSERT_TRUE(test::eventually([&] { return plc.status().recording == PlcRecording::None; }));
  ASSERT_EQ(recordings_of(site).size(), 1U);
  EXPECT_NE(recordings_of(site)[0].string().find("tag0000cafe"), std::string::npos);
  EXPECT_EQ(Recording::open(recordings_of(site)[0]).frame_count(), plc.diagnostic(kRecordFrames));
  EXPECT_EQ(plc.diagnostic(kRecordMissed), 0U);
  EXPECT_EQ(plc.diagnostic(kDropped), 0U);
  EXPECT_EQ(plc.diagnostic(kHeapCalls), 0U) << "of the supervised threads";
}

TEST(Recording, AFullDiskIsAnsweredAndJobsGoOn) {
  const test::Site site;
  site.write("grapnel.toml", test::Site::config_text(10, "[recording]\nmin_free_mb = 100000000\n"));
  test::DaemonProcess daemon(site);
  ASSERT_TRUE(daemon.wait_ready());
  test::Plc plc(daemon.port());
  EXPECT_EQ(code_of(plc.send(PlcCommandCode::RecordBegin)), Code::DiskFull);
  EXPECT_EQ(plc.status().recording, PlcRecording::None);
  EXPECT_TRUE(daemon.says("recording.min_free_mb"));
  PlcCommand command;
  command.timeout_ms = 20000;
  EXPECT_EQ(code_of(plc.send(PlcCommandCode::Register, command)), Code::ObjectFound);
}

TEST(Recording, AKilledDaemonLeavesAReadableRecordingThatLacksAtMostASecond) {
  const test::Site site;
  test::DaemonProcess daemon(site);
  ASSERT_TRUE(daemon.wait_ready());
  std::uint32_t on_disk = 0;
  {
    test::Plc plc(daemon.port());
    ASSERT_EQ(code_of(plc.send(PlcCommandCode::RecordBegin)), Code::CaptureDone);
    ASSERT_TRUE(test::eventually([&] {
      on_disk = plc.diagnostic(kRecordFrames);
      return on_disk >= 20;
    }));
    daemon.signal(SIGKILL);
  }
  EXPECT_EQ(daemon.wait_end(), -SIGKILL);
  ASSERT_EQ(recordings_of(site).size(), 1U);
  const Recording recording = Recording::open(recordings_of(site)[0]);
  EXPECT_GE(recording.frame_count(), on_disk) << "what the PLC was told is on the disk";
  const Intrinsics size = recording.camera().intrinsics();
  std::vector<std::uint16_t> depth(static_cast<std::size_t>(size.width * size.height));
  for (std::size_t i = 0; i < recording.frame_count(); ++i) {
    ASSERT_NO_THROW(recording.read_frame(i, depth, {}));
  }
}

}  // namespace
}  // namespace grapnel
