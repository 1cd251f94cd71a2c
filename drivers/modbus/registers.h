// Generated from drivers/modbus/register_map.toml by grapnel-codegen. Do not edit.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

/// Addresses (0-based) and types of the register map; docs/registers.md is its manual.
namespace grapnel::registers {

/// What a register holds. U32, I32 and F32 take two registers.
enum class RegisterType : std::uint8_t { U16, Bits, U32, I32, F32 };

/// One named register; `count` > 1 is an array. In the block "object" the address is an offset.
struct RegisterInfo {
  std::string_view block;
  std::string_view name;
  std::uint16_t address = 0;
  RegisterType type = RegisterType::U16;
  std::uint16_t count = 1;
};

/// Major × 256 + minor.
inline constexpr std::uint16_t kMapVersion = 256;
/// The input registers, readable as holding registers too.
inline constexpr std::uint16_t kFirstReadOnly = 100;
inline constexpr std::uint16_t kLastReadOnly = 911;

/// Command block.
namespace command {
inline constexpr std::uint16_t kFirst = 0;
inline constexpr std::uint16_t kLast = 31;
/// token; a change to non-zero executes CMD_CODE
inline constexpr std::uint16_t kCmdSeq = 0;
/// what to do: the table of commands
inline constexpr std::uint16_t kCmdCode = 1;
/// preset number; 0 = keep
inline constexpr std::uint16_t kPresetId = 2;
/// model to look for; 0 = all models of the preset
inline constexpr std::uint16_t kModelId = 3;
/// objects to report, 1 to 8; 0 = preset value
inline constexpr std::uint16_t kMaxObjects = 4;
/// bits, 0 = none
inline constexpr std::uint16_t kOptions = 5;
/// hard deadline of the job; 0 = preset value
inline constexpr std::uint16_t kTimeoutMs = 6;
/// format of the poses, 1 to 7; 0 = preset value
inline constexpr std::uint16_t kPoseFormat = 7;
/// encoder count latched with the part sensor; between commands the live count
inline constexpr std::uint16_t kEncTrigger = 8;
/// opaque; echoed in result, log and snapshot name
inline constexpr std::uint16_t kPartTag = 10;
/// flange pose X Y Z R1 R2 R3 R4, scaled as in results
inline constexpr std::uint16_t kRobotPose = 12;
/// heartbeat of the PLC: changes at least once in HB_LIMIT_MS
inline constexpr std::uint16_t kHbIn = 26;
/// 0 = heartbeat not supervised; else 500 to 60000, other values count as the nearer end
inline constexpr std::uint16_t kHbLimitMs = 27;
}  // namespace command

/// Status block.
namespace status {
inline constexpr std::uint16_t kFirst = 100;
inline constexpr std::uint16_t kLast = 119;
/// major × 256 + minor; a changed major means commission again
inline constexpr std::uint16_t kMapVersion = 100;
/// 0 boot, 1 stopped, 2 ready, 3 capturing, 4 processing, 5 result, 6 fault, 7 local control
inline constexpr std::uint16_t kState = 101;
/// bits
inline constexpr std::uint16_t kFlags = 102;
/// +1 every 100 ms, only while all supervised threads make progress
inline constexpr std::uint16_t kHbOut = 103;
/// token of the command answered last; 0 after token 0
inline constexpr std::uint16_t kAckSeq = 104;
/// what the device is at now
inline constexpr std::uint16_t kStatusCode = 105;
/// stage, parameter or system error number
inline constexpr std::uint16_t kStatusDetail = 106;
/// number of the active preset
inline constexpr std::uint16_t kActivePreset = 107;
/// fingerprint of the active preset's file
inline constexpr std::uint16_t kPresetRev = 108;
/// errors since start, wraps
inline constexpr std::uint16_t kErrCount = 109;
/// falls back to 0 after a restart
inline constexpr std::uint16_t kUptimeS = 110;
/// frames delivered by the sensor
inline constexpr std::uint16_t kFrameCount = 112;
/// random per start; a changed value voids every pending handshake
inline constexpr std::uint16_t kBootId = 114;
/// answer to the command in ACK_SEQ: 3100 accepted, 30xx refused
inline constexpr std::uint16_t kAckCode = 115;
/// 0 nothing is recorded, 1 recording, 2 what waits goes to the disk
inline constexpr std::uint16_t kRecording = 116;
}  // namespace status

/// Result block.
namespace result {
inline constexpr std::uint16_t kFirst = 120;
inline constexpr std::uint16_t kLast = 179;
inline constexpr std::uint16_t kRecordFirst = 134;
/// running number of the result, 1 to 65535; 0 = none
inline constexpr std::uint16_t kResNoBegin = 120;
/// token of the command that this answers
inline constexpr std::uint16_t kResCmdSeq = 121;
/// objects found, before the decision
inline constexpr std::uint16_t kNFound = 122;
/// object records filled
inline constexpr std::uint16_t kNReported = 123;
/// sensor frame used
inline constexpr std::uint16_t kFrameId = 124;
/// encoder count at mid-exposure where the PLC streams the live count, else ENC_TRIGGER
inline constexpr std::uint16_t kEncCapture = 126;
/// command accepted to mid-exposure of the frame used
inline constexpr std::uint16_t kCaptureDelayUs = 128;
/// mid-exposure to publication
inline constexpr std::uint16_t kAgeUs = 130;
/// echo of the command's PART_TAG
inline constexpr std::uint16_t kPartTag = 132;
/// the job's outcome
inline constexpr std::uint16_t kResCode = 166;
/// captures repeated
inline constexpr std::uint16_t kRetries = 167;
/// frame complete in memory to publication
inline constexpr std::uint16_t kTTotalUs = 168;
/// preset used
inline constexpr std::uint16_t kResPreset = 170;
/// its fingerprint
inline constexpr std::uint16_t kResPresetRev = 171;
/// seed of the job, for replay
inline constexpr std::uint16_t kResSeed = 172;
/// must equal RES_NO_BEGIN
inline constexpr std::uint16_t kResNoEnd = 179;
}  // namespace result

/// Further objects (2 to 8).
namespace further_objects {
inline constexpr std::uint16_t kFirst = 200;
inline constexpr std::uint16_t kLast = 479;
/// Addresses are those of the first of kCount; the next is kStride further.
inline constexpr std::uint16_t kStride = 40;
inline constexpr std::uint16_t kCount = 7;
inline constexpr std::uint16_t kRecordFirst = 201;
/// result number that the record belongs to
inline constexpr std::uint16_t kObjNoBegin = 200;
/// must equal OBJ_NO_BEGIN
inline constexpr std::uint16_t kObjNoEnd = 239;
}  // namespace further_objects

/// Diagnostics.
namespace diagnostics {
inline constexpr std::uint16_t kFirst = 600;
inline constexpr std::uint16_t kLast = 699;
/// frames received
inline constexpr std::uint16_t kFrames = 600;
/// frames dropped
inline constexpr std::uint16_t kDroppedFrames = 602;
/// sensor packets lost
inline constexpr std::uint16_t kLostPackets = 604;
/// times the sensor came back
inline constexpr std::uint16_t kReconnects = 606;
/// jobs ended
inline constexpr std::uint16_t kJobs = 608;
/// jobs with an accepted object or a surface grasp
inline constexpr std::uint16_t kJobsAccepted = 610;
/// jobs without one
inline constexpr std::uint16_t kJobsRejected = 612;
/// jobs ended by their deadline
inline constexpr std::uint16_t kDeadlinesMissed = 614;
/// commands that came while busy
inline constexpr std::uint16_t kOverruns = 616;
/// heap calls of supervised threads since READY; must stay 0
inline constexpr std::uint16_t kHeapCalls = 618;
/// page faults of supervised threads since READY; must stay 0
inline constexpr std::uint16_t kPageFaults = 620;
/// Modbus TCP connections now
inline constexpr std::uint16_t kClients = 622;
/// connections refused: address not allowed or no place left
inline constexpr std::uint16_t kConnectionsRefused = 624;
/// writes refused because the peer does not own the command block
inline constexpr std::uint16_t kRequestsRefused = 626;
/// Modbus exceptions sent
inline constexpr std::uint16_t kExceptionsSent = 628;
/// received bytes that belonged to no valid request
inline constexpr std::uint16_t kBytesDiscarded = 630;
/// configurations taken over
inline constexpr std::uint16_t kConfigReloads = 632;
/// configurations refused
inline constexpr std::uint16_t kConfigRefusals = 634;
/// belt plane seen against belt plane taught
inline constexpr std::uint16_t kBeltResidualUm = 636;
/// tilt of the sensor against commissioning
inline constexpr std::uint16_t kTilt = 638;
/// hash of the sensor's serial
inline constexpr std::uint16_t kSerialHash = 640;
/// hash of the program's build
inline constexpr std::uint16_t kBuildHash = 642;
/// longest job
inline constexpr std::uint16_t kWorstJobUs = 644;
/// frames on the disk, of the recording under way or the last one
inline constexpr std::uint16_t kRecordFrames = 646;
/// frames of the sensor that it did not catch
inline constexpr std::uint16_t kRecordMissed = 648;
/// frames that the disk did not take
inline constexpr std::uint16_t kRecordDropped = 650;
/// last time per stage
inline constexpr std::uint16_t kStageUs = 660;
}  // namespace diagnostics

/// Float mirror.
namespace float_mirror {
inline constexpr std::uint16_t kFirst = 700;
inline constexpr std::uint16_t kLast = 827;
/// Addresses are those of the first of kCount; the next is kStride further.
inline constexpr std::uint16_t kStride = 16;
inline constexpr std::uint16_t kCount = 8;
/// result number that the pose belongs to
inline constexpr std::uint16_t kFltNoBegin = 700;
/// position
inline constexpr std::uint16_t kXMm = 701;
/// position
inline constexpr std::uint16_t kYMm = 703;
/// position
inline constexpr std::uint16_t kZMm = 705;
/// rotation, in degrees, radians or quaternion part by POSE_FORMAT
inline constexpr std::uint16_t kR1Real = 707;
/// rotation
inline constexpr std::uint16_t kR2Real = 709;
/// rotation
inline constexpr std::uint16_t kR3Real = 711;
/// rotation
inline constexpr std::uint16_t kR4Real = 713;
/// must equal FLT_NO_BEGIN
inline constexpr std::uint16_t kFltNoEnd = 715;
}  // namespace float_mirror

/// Probe.
namespace probe {
inline constexpr std::uint16_t kFirst = 900;
inline constexpr std::uint16_t kLast = 911;
/// 0x12345678 = 305419896
inline constexpr std::uint16_t kProbeU32 = 900;
/// -123456
inline constexpr std::uint16_t kProbeI32 = 902;
/// 123456.0
inline constexpr std::uint16_t kProbeF32 = 904;
/// 0x4142 (AB) = 16706
inline constexpr std::uint16_t kProbeAb = 906;
/// +1 every 100 ms
inline constexpr std::uint16_t kProbeCounter = 907;
}  // namespace probe

/// Object record: offsets from its first register.
namespace object {
inline constexpr std::uint16_t kLength = 32;
/// model found
inline constexpr std::uint16_t kModelId = 0;
/// grasp of the model
inline constexpr std::uint16_t kPickPointId = 1;
/// format really used
inline constexpr std::uint16_t kPoseFormat = 2;
/// 0 camera, 1 robot base, 2 conveyor
inline constexpr std::uint16_t kFrame = 3;
/// position of the grasp, raw in um
inline constexpr std::uint16_t kX = 4;
/// position
inline constexpr std::uint16_t kY = 6;
/// position
inline constexpr std::uint16_t kZ = 8;
/// rotation by POSE_FORMAT: raw in 0.001 deg or 0.000001
inline constexpr std::uint16_t kR1 = 10;
/// rotation
inline constexpr std::uint16_t kR2 = 12;
/// rotation
inline constexpr std::uint16_t kR3 = 14;
/// rotation; 0 unless the format has four parts
inline constexpr std::uint16_t kR4 = 16;
/// 0 reject, 1 accept (a model's pose), 2 surface grasp, only where the preset asks for it
inline constexpr std::uint16_t kDecision = 18;
/// matched share of the visible model
inline constexpr std::uint16_t kFitness = 19;
/// of the matched; saturates
inline constexpr std::uint16_t kRmseUm = 20;
/// share of the whole model surface confirmed
inline constexpr std::uint16_t kCoverage = 21;
/// 1 - S2/S1 to the next distinct pose; 0 = ambiguous
inline constexpr std::uint16_t kMargin = 22;
/// share of visible samples that the camera sees through
inline constexpr std::uint16_t kFreeSpaceViol = 23;
/// predicted translation sigma in the weakest required direction
inline constexpr std::uint16_t kSigmaUm = 24;
/// predicted rotation sigma
inline constexpr std::uint16_t kSigmaMdeg = 25;
/// bits
inline constexpr std::uint16_t kQuality = 26;
/// 0 to 1000, larger is better
inline constexpr std::uint16_t kQualityScore = 27;
/// 1100 accepted, 1104 surface grasp, else the first failing reason
inline constexpr std::uint16_t kObjCode = 28;
/// every failing reason: bit n = code 1000 + n
inline constexpr std::uint16_t kReasons = 29;
}  // namespace object

/// Every named register, blocks in address order, the object record last.
inline constexpr std::array<RegisterInfo, 110> kRegisters = {{
    {"command", "CMD_SEQ", 0, RegisterType::U16, 1},
    {"command", "CMD_CODE", 1, RegisterType::U16, 1},
    {"command", "PRESET_ID", 2, RegisterType::U16, 1},
    {"command", "MODEL_ID", 3, RegisterType::U16, 1},
    {"command", "MAX_OBJECTS", 4, RegisterType::U16, 1},
    {"command", "OPTIONS", 5, RegisterType::Bits, 1},
    {"command", "TIMEOUT_MS", 6, RegisterType::U16, 1},
    {"command", "POSE_FORMAT", 7, RegisterType::U16, 1},
    {"command", "ENC_TRIGGER", 8, RegisterType::U32, 1},
    {"command", "PART_TAG", 10, RegisterType::U32, 1},
    {"command", "ROBOT_POSE", 12, RegisterType::I32, 7},
    {"command", "HB_IN", 26, RegisterType::U16, 1},
    {"command", "HB_LIMIT_MS", 27, RegisterType::U16, 1},
    {"status", "MAP_VERSION", 100, RegisterType::U16, 1},
    {"status", "STATE", 101, RegisterType::U16, 1},
    {"status", "FLAGS", 102, RegisterType::Bits, 1},
    {"status", "HB_OUT", 103, RegisterType::U16, 1},
    {"status", "ACK_SEQ", 104, RegisterType::U16, 1},
    {"status", "STATUS_CODE", 105, RegisterType::U16, 1},
    {"status", "STATUS_DETAIL", 106, RegisterType::U16, 1},
    {"status", "ACTIVE_PRESET", 107, RegisterType::U16, 1},
    {"status", "PRESET_REV", 108, RegisterType::U16, 1},
    {"status", "ERR_COUNT", 109, RegisterType::U16, 1},
    {"status", "UPTIME_S", 110, RegisterType::U32, 1},
    {"status", "FRAME_COUNT", 112, RegisterType::U32, 1},
    {"status", "BOOT_ID", 114, RegisterType::U16, 1},
    {"status", "ACK_CODE", 115, RegisterType::U16, 1},
    {"status", "RECORDING", 116, RegisterType::U16, 1},
    {"result", "RES_NO_BEGIN", 120, RegisterType::U16, 1},
    {"result", "RES_CMD_SEQ", 121, RegisterType::U16, 1},
    {"result", "N_FOUND", 122, RegisterType::U16, 1},
    {"result", "N_REPORTED", 123, RegisterType::U16, 1},
    {"result", "FRAME_ID", 124, RegisterType::U32, 1},
    {"result", "ENC_CAPTURE", 126, RegisterType::U32, 1},
    {"result", "CAPTURE_DELAY_US", 128, RegisterType::U32, 1},
    {"result", "AGE_US", 130, RegisterType::U32, 1},
    {"result", "PART_TAG", 132, RegisterType::U32, 1},
    {"result", "RES_CODE", 166, RegisterType::U16, 1},
    {"result", "RETRIES", 167, RegisterType::U16, 1},
    {"result", "T_TOTAL_US", 168, RegisterType::U32, 1},
    {"result", "RES_PRESET", 170, RegisterType::U16, 1},
    {"result", "RES_PRESET_REV", 171, RegisterType::U16, 1},
    {"result", "RES_SEED", 172, RegisterType::U32, 1},
    {"result", "RES_NO_END", 179, RegisterType::U16, 1},
    {"further_objects", "OBJ_NO_BEGIN", 200, RegisterType::U16, 1},
    {"further_objects", "OBJ_NO_END", 239, RegisterType::U16, 1},
    {"diagnostics", "FRAMES", 600, RegisterType::U32, 1},
    {"diagnostics", "DROPPED_FRAMES", 602, RegisterType::U32, 1},
    {"diagnostics", "LOST_PACKETS", 604, RegisterType::U32, 1},
    {"diagnostics", "RECONNECTS", 606, RegisterType::U32, 1},
    {"diagnostics", "JOBS", 608, RegisterType::U32, 1},
    {"diagnostics", "JOBS_ACCEPTED", 610, RegisterType::U32, 1},
    {"diagnostics", "JOBS_REJECTED", 612, RegisterType::U32, 1},
    {"diagnostics", "DEADLINES_MISSED", 614, RegisterType::U32, 1},
    {"diagnostics", "OVERRUNS", 616, RegisterType::U32, 1},
    {"diagnostics", "HEAP_CALLS", 618, RegisterType::U32, 1},
    {"diagnostics", "PAGE_FAULTS", 620, RegisterType::U32, 1},
    {"diagnostics", "CLIENTS", 622, RegisterType::U32, 1},
    {"diagnostics", "CONNECTIONS_REFUSED", 624, RegisterType::U32, 1},
    {"diagnostics", "REQUESTS_REFUSED", 626, RegisterType::U32, 1},
    {"diagnostics", "EXCEPTIONS_SENT", 628, RegisterType::U32, 1},
    {"diagnostics", "BYTES_DISCARDED", 630, RegisterType::U32, 1},
    {"diagnostics", "CONFIG_RELOADS", 632, RegisterType::U32, 1},
    {"diagnostics", "CONFIG_REFUSALS", 634, RegisterType::U32, 1},
    {"diagnostics", "BELT_RESIDUAL_UM", 636, RegisterType::I32, 1},
    {"diagnostics", "TILT", 638, RegisterType::I32, 1},
    {"diagnostics", "SERIAL_HASH", 640, RegisterType::U32, 1},
    {"diagnostics", "BUILD_HASH", 642, RegisterType::U32, 1},
    {"diagnostics", "WORST_JOB_US", 644, RegisterType::U32, 1},
    {"diagnostics", "RECORD_FRAMES", 646, RegisterType::U32, 1},
    {"diagnostics", "RECORD_MISSED", 648, RegisterType::U32, 1},
    {"diagnostics", "RECORD_DROPPED", 650, RegisterType::U32, 1},
    {"diagnostics", "STAGE_US", 660, RegisterType::U32, 20},
    {"float_mirror", "FLT_NO_BEGIN", 700, RegisterType::U16, 1},
    {"float_mirror", "X_MM", 701, RegisterType::F32, 1},
    {"float_mirror", "Y_MM", 703, RegisterType::F32, 1},
    {"float_mirror", "Z_MM", 705, RegisterType::F32, 1},
    {"float_mirror", "R1_REAL", 707, RegisterType::F32, 1},
    {"float_mirror", "R2_REAL", 709, RegisterType::F32, 1},
    {"float_mirror", "R3_REAL", 711, RegisterType::F32, 1},
    {"float_mirror", "R4_REAL", 713, RegisterType::F32, 1},
    {"float_mirror", "FLT_NO_END", 715, RegisterType::U16, 1},
    {"probe", "PROBE_U32", 900, RegisterType::U32, 1},
    {"probe", "PROBE_I32", 902, RegisterType::I32, 1},
    {"probe", "PROBE_F32", 904, RegisterType::F32, 1},
    {"probe", "PROBE_AB", 906, RegisterType::U16, 1},
    {"probe", "PROBE_COUNTER", 907, RegisterType::U32, 1},
    {"object", "MODEL_ID", 0, RegisterType::U16, 1},
    {"object", "PICK_POINT_ID", 1, RegisterType::U16, 1},
    {"object", "POSE_FORMAT", 2, RegisterType::U16, 1},
    {"object", "FRAME", 3, RegisterType::U16, 1},
    {"object", "X", 4, RegisterType::I32, 1},
    {"object", "Y", 6, RegisterType::I32, 1},
    {"object", "Z", 8, RegisterType::I32, 1},
    {"object", "R1", 10, RegisterType::I32, 1},
    {"object", "R2", 12, RegisterType::I32, 1},
    {"object", "R3", 14, RegisterType::I32, 1},
    {"object", "R4", 16, RegisterType::I32, 1},
    {"object", "DECISION", 18, RegisterType::U16, 1},
    {"object", "FITNESS", 19, RegisterType::U16, 1},
    {"object", "RMSE_UM", 20, RegisterType::U16, 1},
    {"object", "COVERAGE", 21, RegisterType::U16, 1},
    {"object", "MARGIN", 22, RegisterType::U16, 1},
    {"object", "FREE_SPACE_VIOL", 23, RegisterType::U16, 1},
    {"object", "SIGMA_UM", 24, RegisterType::U16, 1},
    {"object", "SIGMA_MDEG", 25, RegisterType::U16, 1},
    {"object", "QUALITY", 26, RegisterType::Bits, 1},
    {"object", "QUALITY_SCORE", 27, RegisterType::U16, 1},
    {"object", "OBJ_CODE", 28, RegisterType::U16, 1},
    {"object", "REASONS", 29, RegisterType::U32, 1},
}};

}  // namespace grapnel::registers
