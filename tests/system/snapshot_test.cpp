#include <gtest/gtest.h>

#include <sys/wait.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "firmware_app/snapshot.h"
#include "tests/system/daemon_process.h"

namespace grapnel {
namespace {

namespace fs = std::filesystem;

std::vector<fs::path> snapshots_of(const test::Site& site) {
  std::vector<fs::path> files;
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(site.folder() / "state" / "snapshots", none)) {
    if (entry.path().extension() == ".snapshot") files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

/// Exit status of `grapnel replay FILE -o REPORT`.
int replay(const fs::path& file, const fs::path& report) {
  const std::string command = std::string(GRAPNEL_BINARY_DIR) + "/bin/grapnel replay " +
                              file.string() + " -o " + report.string() + " > /dev/null";
  const int status = std::system(command.c_str());
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

TEST(Snapshots, ARejectedJobReplaysToAByteIdenticalReport) {
  const test::Site site;
  site.write("grapnel.toml", test::Site::config_text(11));  // a box, where a sack lies
  test::DaemonProcess daemon(site);
  ASSERT_TRUE(daemon.wait_ready());
  test::Plc plc(daemon.port());
  PlcCommand command;
  command.timeout_ms = 20000;
  command.part_tag = 0xbeef;
  const PlcAnswer answer = plc.send(PlcCommandCode::Register, command);
  ASSERT_NE(answer.reading.result.code, Code::ObjectFound);
  ASSERT_LT(static_cast<int>(answer.reading.result.code), 1019) << "a rejection was wanted";
  ASSERT_TRUE(test::eventually([&] { return !snapshots_of(site).empty(); }));
  const fs::path file = snapshots_of(site).front();
  EXPECT_NE(file.string().find("tag0000beef"), std::string::npos);
  const Snapshot snapshot = read_snapshot(file);
  EXPECT_EQ(snapshot.evidence.result.code, answer.reading.result.code);
  EXPECT_EQ(snapshot.preset.config, site.read("grapnel.toml"));
  EXPECT_EQ(snapshot.preset.text, site.read("presets/11-box.toml"));
  EXPECT_FALSE(snapshot.build.empty());
  const fs::path report = site.folder() / "report.txt";
  EXPECT_EQ(replay(file, report), 0);
  EXPECT_EQ(site.read("report.txt"), snapshot.report);
}

TEST(Snapshots, GraspFeedbackLabelsTheLastResultsSnapshot) {
  const test::Site site;
  test::DaemonProcess daemon(site);
  ASSERT_TRUE(daemon.wait_ready());
  test::Plc plc(daemon.port());
  EXPECT_EQ(plc.send(PlcCommandCode::SaveSnapshot).reading.result.code, Code::BadParameter)
      << "there was no job yet";
  PlcCommand command;
  command.timeout_ms = 20000;
  ASSERT_EQ(plc.send(PlcCommandCode::Register, command).reading.result.code, Code::ObjectFound);
  EXPECT_EQ(plc.send(PlcCommandCode::SaveSnapshot).reading.result.code, Code::CaptureDone);
  ASSERT_TRUE(test::eventually([&] { return !snapshots_of(site).empty(); }));
  const fs::path file = snapshots_of(site).front();
  EXPECT_EQ(read_snapshot(file).evidence.label, GraspLabel::None);
  EXPECT_EQ(plc.send(PlcCommandCode::GraspBad).reading.result.code, Code::CaptureDone);
  EXPECT_TRUE(
      test::eventually([&] { return read_snapshot(file).evidence.label == GraspLabel::Bad; }));
  EXPECT_EQ(snapshots_of(site).size(), 1U) << "the label belongs to the same job";
  EXPECT_EQ(replay(file, site.folder() / "report.txt"), 0);
}

TEST(Snapshots, AGoodAndABadGraspEachLabelTheJobBeforeThem) {
  const test::Site site;
  test::DaemonProcess daemon(site);
  ASSERT_TRUE(daemon.wait_ready());
  test::Plc plc(daemon.port());
  for (const PlcCommandCode label : {PlcCommandCode::GraspGood, PlcCommandCode::GraspBad}) {
    EXPECT_EQ(plc.send(label).reading.result.code, Code::BadParameter) << "there was no job yet";
  }
  PlcCommand command;
  command.timeout_ms = 20000;
  command.part_tag = 0x51;
  ASSERT_EQ(plc.send(PlcCommandCode::Register, command).reading.result.code, Code::ObjectFound);
  EXPECT_EQ(plc.send(PlcCommandCode::GraspGood).reading.result.code, Code::CaptureDone);
  ASSERT_TRUE(test::eventually([&] { return snapshots_of(site).size() == 1; }));
  command.part_tag = 0x52;
  ASSERT_EQ(plc.send(PlcCommandCode::Register, command).reading.result.code, Code::ObjectFound);
  EXPECT_EQ(plc.send(PlcCommandCode::GraspBad).reading.result.code, Code::CaptureDone);
  ASSERT_TRUE(test::eventually([&] { return snapshots_of(site).size() == 2; }));
  for (const fs::path& file : snapshots_of(site)) {
    const bool first = file.string().find("tag00000051") != std::string::npos;
    EXPECT_NE(first, file.string().find("tag00000052") != std::string::npos) << file;
    EXPECT_EQ(read_snapshot(file).evidence.label, first ? GraspLabel::Good : GraspLabel::Bad);
    EXPECT_EQ(replay(file, site.folder() / "report.txt"), 0);
  }
}

}  // namespace
}  // namespace grapnel
