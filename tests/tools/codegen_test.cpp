#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <set>
#include <string>

#include "base/input_error.h"
#include "drivers/modbus/register_image.h"
#include "hal/plc.h"
#include "tools/codegen/generate.h"

namespace grapnel::codegen {
namespace {

namespace fs = std::filesystem;

const fs::path kRoot = GRAPNEL_SOURCE_DIR;
const fs::path kMapFile = kRoot / "drivers/modbus/register_map.toml";

std::string read_whole(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

TEST(Codegen, EveryCommittedFileIsWhatItsTableGives) {
  const auto files = generate_all(kRoot);
  EXPECT_EQ(files.size(), 7u);
  for (const GeneratedFile& file : files) {
    EXPECT_TRUE(read_whole(kRoot / file.path) == file.text)
        << file.path << " differs; run grapnel-codegen --write " << kRoot;
  }
}

// "2 DONE" → 1 << 2.
std::map<std::string, unsigned> bits_of(const std::vector<RegisterRow>& rows,
                                        const std::string& name) {
  std::map<std::string, unsigned> bits;
  for (const RegisterRow& row : rows) {
    if (row.name != name) continue;
    for (const std::string& bit : row.bits) {
      const std::size_t space = bit.find(' ');
      bits[bit.substr(space + 1)] = 1u << std::stoul(bit.substr(0, space));
    }
  }
  return bits;
}

TEST(RegisterMapTable, BitsAreThoseOfThePlcInterface) {
  const RegisterMap map = load_register_map(kMapFile);
  EXPECT_EQ(bits_of(map.block("status").registers, "FLAGS"),
            (std::map<std::string, unsigned>{{"READY", kFlagReady},
                                             {"BUSY", kFlagBusy},
                                             {"DONE", kFlagDone},
                                             {"RESULT_VALID", kFlagResultValid},
                                             {"ERROR", kFlagError},
                                             {"WARNING", kFlagWarning},
                                             {"SENSOR_OK", kFlagSensorOk},
                                             {"CALIB_OK", kFlagCalibOk},
                                             {"PRESET_OK", kFlagPresetOk},
                                             {"REPLAY", kFlagReplay},
                                             {"HB_IN_LOST", kFlagHeartbeatLost},
                                             {"OVERRUN", kFlagOverrun},
                                             {"LOCAL_LOCK", kFlagLocalLock},
                                             {"REDUCED", kFlagReduced},
                                             {"HB", kFlagHeartbeat}}));
  EXPECT_EQ(bits_of(map.block("command").registers, "OPTIONS"),
            (std::map<std::string, unsigned>{{"SNAPSHOT_ALWAYS", kOptionSnapshotAlways},
                                             {"SNAPSHOT_ON_REJECT", kOptionSnapshotOnReject},
                                             {"CAMERA_FRAME", kOptionCameraFrame},
                                             {"USE_LAST_CAPTURE", kOptionUseLastCapture},
                                             {"NO_RETRY", kOptionNoRetry}}));
  EXPECT_EQ(bits_of(map.record.registers, "QUALITY"),
            (std::map<std::string, unsigned>{{"SYMMETRIC", kQualitySymmetric},
                                             {"LOST_PACKETS", kQualityLostPackets},
                                             {"LOW_COVERAGE", kQualityLowCoverage},
                                             {"ROI_EDGE", kQualityRoiEdge},
                                             {"BUDGET_REACHED", kQualityBudgetReached},
                                             {"RETRIED", kQualityRetried}}));
}

TEST(RegisterMapTable, CommandsIncludeThoseOfThePlcInterface) {
  std::set<std::uint16_t> codes;
  for (const CommandRow& row : load_register_map(kMapFile).commands) codes.insert(row.code);
  for (const PlcCommandCode code : {PlcCommandCode::Arm,
                                    PlcCommandCode::Stop,
                                    PlcCommandCode::Register,
                                    PlcCommandCode::Capture,
                                    PlcCommandCode::RegisterLastCapture,
                                    PlcCommandCode::Abort,
                                    PlcCommandCode::RegisterWithRetries,
                                    PlcCommandCode::ClearResult,
                                    PlcCommandCode::SelectPreset,
                                    PlcCommandCode::CheckPreset,
                                    PlcCommandCode::ReloadConfig,
                                    PlcCommandCode::LastGoodConfig,
                                    PlcCommandCode::SaveSnapshot,
                                    PlcCommandCode::GraspGood,
                                    PlcCommandCode::RecordBegin,
                                    PlcCommandCode::RecordEnd,
                                    PlcCommandCode::GraspBad,
                                    PlcCommandCode::LearnBackground,
                                    PlcCommandCode::CheckRoiEmpty,
                                    PlcCommandCode::SelfTest,
                                    PlcCommandCode::ResetFault,
                                    PlcCommandCode::ClearCounters}) {
    EXPECT_TRUE(codes.contains(static_cast<std::uint16_t>(code)));
  }
}

// The addresses a PLC program depends on, written out by hand.
TEST(RegisterMapTable, VersionOneKeepsItsAddresses) {
  const std::map<std::string, int> pinned = {{"command.CMD_SEQ", 0},
                                             {"command.CMD_CODE", 1},
                                             {"command.PRESET_ID", 2},
                                             {"command.TIMEOUT_MS", 6},
                                             {"command.POSE_FORMAT", 7},
                                             {"command.ENC_TRIGGER", 8},
                                             {"command.PART_TAG", 10},
                                             {"command.ROBOT_POSE", 12},
                                             {"command.HB_IN", 26},
                                             {"command.HB_LIMIT_MS", 27},
                                             {"status.MAP_VERSION", 100},
                                             {"status.STATE", 101},
                                             {"status.FLAGS", 102},
                                             {"status.HB_OUT", 103},
                                             {"status.ACK_SEQ", 104},
                                             {"status.STATUS_CODE", 105},
                                             {"status.UPTIME_S", 110},
                                             {"status.FRAME_COUNT", 112},
                                             {"status.BOOT_ID", 114},
                                             {"status.ACK_CODE", 115},
                                             {"result.RES_NO_BEGIN", 120},
                                             {"result.RES_CMD_SEQ", 121},
                                             {"result.N_REPORTED", 123},
                                             {"result.PART_TAG", 132},
                                             {"result.RES_CODE", 166},
                                             {"result.RES_SEED", 172},
                                             {"result.RES_NO_END", 179},
                                             {"object.X", 4},
                                             {"object.R4", 16},
                                             {"object.DECISION", 18},
                                             {"object.FITNESS", 19},
                                             {"object.OBJ_CODE", 28},
                                             {"object.REASONS", 29},
                                             {"diagnostics.FRAMES", 600},
                                             {"diagnostics.CLIENTS", 622},
                                             {"diagnostics.WORST_JOB_US", 644},
                                             {"diagnostics.STAGE_US", 660},
                                             {"float_mirror.X_MM", 701},
                                             {"probe.PROBE_U32", 900},
                                             {"probe.PROBE_COUNTER", 907}};
  std::map<std::string, int> found;
  for (const registers::RegisterInfo& info : registers::kRegisters) {
    const std::string name = std::string(info.block) + "." + std::string(info.name);
    if (pinned.contains(name)) found[name] = info.address;
  }
  EXPECT_EQ(found, pinned);
  EXPECT_EQ(registers::kMapVersion, 256);
}

class BrokenTable : public testing::Test {
 protected:
  BrokenTable()
      : file_(fs::temp_directory_path() / ("grapnel-map-" + std::to_string(getpid()) + ".toml")) {}
  ~BrokenTable() override { fs::remove(file_); }

  /// What the loader says of the map with one text replaced.
  std::string refusal(const std::string& from, const std::string& to) const {
    std::string text = read_whole(kMapFile);
    const std::size_t at = text.find(from);
    if (at == std::string::npos) return "the map has no " + from;
    text.replace(at, from.size(), to);
    std::ofstream(file_) << text;
    try {
      static_cast<void>(load_register_map(file_));
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  }

  fs::path file_;
};

TEST_F(BrokenTable, IsRefusedWithItsLine) {
  EXPECT_THAT(refusal("address = 101", "address = 100"), testing::HasSubstr("overlaps"));
  EXPECT_THAT(refusal("address = 179", "address = 180"), testing::HasSubstr("leaves its block"));
  EXPECT_THAT(refusal("type = \"bits\"", "type = \"byte\""), testing::HasSubstr("byte"));
  EXPECT_THAT(refusal("last = 179", "last = 210"), testing::HasSubstr("overlaps the block"));
  EXPECT_THAT(refusal("note = ", "nota = "), testing::HasSubstr("did you mean \"note\""));
  EXPECT_THAT(refusal("address = 101", "address = 100"), testing::HasSubstr(".toml:"));
}

TEST(Codegen, NamesConstantsAndScales) {
  EXPECT_EQ(constant_name("CMD_SEQ"), "kCmdSeq");
  EXPECT_EQ(constant_name("R1"), "kR1");
  EXPECT_EQ(constant_name("T_TOTAL_US"), "kTTotalUs");
  EXPECT_EQ(scale_text(1.0), "1");
  EXPECT_EQ(scale_text(0.001), "0.001");
  EXPECT_EQ(scale_text(0.0001), "0.0001");
  EXPECT_EQ(scale_text(0.000001), "0.000001");
  EXPECT_EQ(scale_text(0.0), "0");
}

}  // namespace
}  // namespace grapnel::codegen
