#pragma once

#include <array>
#include <cstdint>

#include "base/code.h"
#include "base/error.h"
#include "base/fixed_list.h"
#include "base/geometry.h"

namespace grapnel {

/// Command codes (CMD_CODE).
enum class PlcCommandCode : std::uint16_t {
  None = 0,
  Arm = 10,
  Stop = 11,
  Register = 20,
  Capture = 21,
  RegisterLastCapture = 22,
  Abort = 23,
  RegisterWithRetries = 24,
  ClearResult = 31,
  SelectPreset = 40,
  CheckPreset = 41,
  ReloadConfig = 42,
  LastGoodConfig = 43,
  SaveSnapshot = 50,
  GraspGood = 51,
  GraspBad = 52,
  RecordBegin = 53,
  RecordEnd = 54,
  LearnBackground = 60,
  CheckRoiEmpty = 61,
  SelfTest = 80,
  ResetFault = 81,
  ClearCounters = 82,
};

/// One command as the PLC wrote it. Accepted at `accepted_us`: the job's deadline runs from there.
struct PlcCommand {
  std::uint16_t seq = 0;          ///< token
  std::uint16_t code = 0;         ///< PlcCommandCode, or any number the PLC wrote
  std::uint16_t preset_id = 0;    ///< 0 = keep
  std::uint16_t model_id = 0;     ///< 0 = all
  std::uint16_t max_objects = 0;  ///< 0 = preset value
  std::uint16_t options = 0;      ///< kOption… bits
  std::uint16_t timeout_ms = 0;   ///< 0 = preset value
  std::uint16_t pose_format = 0;  ///< 0 = preset value
  std::uint32_t enc_trigger = 0;
  std::uint32_t part_tag = 0;
  std::array<std::int32_t, 7> robot_pose{};
  std::int64_t accepted_us = 0;  ///< host monotonic
};

inline constexpr std::uint16_t kOptionSnapshotAlways = 1u << 0;
inline constexpr std::uint16_t kOptionSnapshotOnReject = 1u << 1;
inline constexpr std::uint16_t kOptionCameraFrame = 1u << 2;
inline constexpr std::uint16_t kOptionUseLastCapture = 1u << 3;
inline constexpr std::uint16_t kOptionNoRetry = 1u << 4;

enum class PlcState : std::uint16_t {
  Boot = 0,
  Stopped = 1,
  Ready = 2,
  Capturing = 3,
  Processing = 4,
  Result = 5,
  Fault = 6,
  LocalControl = 7,
};

/// RECORDING: what the recorder of the PLC's commands 53 and 54 does.
enum class PlcRecording : std::uint16_t {
  None = 0,
  Running = 1,
  Ending = 2,  ///< no frame is taken any more, what waits goes to the disk
};

/// FLAGS bits.
inline constexpr std::uint16_t kFlagReady = 1u << 0;
inline constexpr std::uint16_t kFlagBusy = 1u << 1;
inline constexpr std::uint16_t kFlagDone = 1u << 2;
inline constexpr std::uint16_t kFlagResultValid = 1u << 3;
inline constexpr std::uint16_t kFlagError = 1u << 4;
inline constexpr std::uint16_t kFlagWarning = 1u << 5;
inline constexpr std::uint16_t kFlagSensorOk = 1u << 6;
inline constexpr std::uint16_t kFlagCalibOk = 1u << 7;
inline constexpr std::uint16_t kFlagPresetOk = 1u << 8;
inline constexpr std::uint16_t kFlagReplay = 1u << 9;
inline constexpr std::uint16_t kFlagHeartbeatLost = 1u << 10;
inline constexpr std::uint16_t kFlagOverrun = 1u << 11;
inline constexpr std::uint16_t kFlagLocalLock = 1u << 12;
inline constexpr std::uint16_t kFlagReduced = 1u << 13;
inline constexpr std::uint16_t kFlagHeartbeat = 1u << 15;

/// Which frame a pose is given in (object record FRAME).
enum class PoseFrame : std::uint16_t { Camera = 0, RobotBase = 1, Conveyor = 2 };

/// Object record DECISION.
inline constexpr std::uint16_t kDecisionReject = 0;
inline constexpr std::uint16_t kDecisionModelPose = 1;
inline constexpr std::uint16_t kDecisionSurfaceGrasp = 2;

/// Object record QUALITY bits.
inline constexpr std::uint16_t kQualitySymmetric = 1u << 0;
inline constexpr std::uint16_t kQualityLostPackets = 1u << 1;
inline constexpr std::uint16_t kQualityLowCoverage = 1u << 2;
inline constexpr std::uint16_t kQualityRoiEdge = 1u << 3;
inline constexpr std::uint16_t kQualityBudgetReached = 1u << 4;
inline constexpr std::uint16_t kQualityRetried = 1u << 5;

inline constexpr std::size_t kMaxObjects = 8;

/// One object of a result. Ratios in 0…1, lengths in metres, angles in radians: the field bus
/// scales.
struct PlcObject {
  std::uint16_t model_id = 0;
  std::uint16_t pick_point_id = 0;
  PoseFrame frame = PoseFrame::Camera;
  Pose frame_from_grasp = Pose::Identity();  ///< meaningful only with has_pose()
  bool accepted = false;
  bool surface_grasp = false;  ///< no model fits; the pose is a grasp on the object's top
  double fitness = 0.0;
  double rmse_m = 0.0;
  double coverage = 0.0;
  double margin = 0.0;
  double free_space_violation = 0.0;
  double sigma_m = 0.0;
  double sigma_rad = 0.0;
  std::uint16_t quality_bits = 0;
  std::uint16_t quality_score = 0;  ///< 0…1000
  Code code = Code::NoObjectAccepted;
  std::uint32_t reasons = 0;  ///< bit n = code 1000 + n

  /// Something a robot may act on, if it knows to tell the two.
  [[nodiscard]] bool has_pose() const noexcept { return accepted || surface_grasp; }
};

/// One finished job. Published whole; stays latched until the next accepted command or a clear.
struct PlcResult {
  std::uint16_t cmd_seq = 0;
  Code code = Code::NoObjectAccepted;  ///< RES_CODE
  std::uint16_t found = 0;
  std::uint16_t pose_format = 0;
  std::uint32_t frame_id = 0;
  std::uint32_t enc_capture = 0;
  std::uint32_t capture_delay_us = 0;
  std::uint32_t age_us = 0;  ///< up to the moment of publication
  std::uint32_t part_tag = 0;
  std::uint16_t retries = 0;
  std::uint32_t total_us = 0;
  std::uint16_t preset = 0;
  std::uint16_t preset_rev = 0;
  std::uint32_t seed = 0;
  InlineList<PlcObject, kMaxObjects> objects;  ///< best first
};

/// Counters of the diagnostics block that the field bus does not know by itself.
struct PlcDiagnostics {
  std::uint32_t frames = 0;
  std::uint32_t dropped_frames = 0;
  std::uint32_t lost_packets = 0;
  std::uint32_t reconnects = 0;
  std::uint32_t jobs = 0;
  std::uint32_t jobs_accepted = 0;
  std::uint32_t jobs_rejected = 0;
  std::uint32_t deadlines_missed = 0;
  std::uint32_t overruns = 0;
  std::uint32_t heap_calls = 0;
  std::uint32_t page_faults = 0;
  std::uint32_t config_reloads = 0;
  std::uint32_t config_refusals = 0;
  std::int32_t belt_residual_um = 0;
  std::int32_t tilt_mdeg = 0;
  std::uint32_t serial_hash = 0;
  std::uint32_t build_hash = 0;
  std::uint32_t worst_job_us = 0;
  std::uint32_t record_frames = 0;   ///< of the recording under way, or the last one: on the disk,
  std::uint32_t record_missed = 0;   ///< not caught,
  std::uint32_t record_dropped = 0;  ///< that the disk did not take
  std::array<std::uint32_t, 20> stage_us{};  ///< last time per stage, in Stage's order from Capture
};

/// What the device is at now. Published whole, as often as it changes and every 100 ms.
struct PlcStatus {
  PlcState state = PlcState::Boot;
  std::uint16_t flags =
      0;  ///< without kFlagHeartbeat, which the field bus derives from `heartbeat`
  std::uint16_t heartbeat =
      0;  ///< HB_OUT: advanced by the supervisor every 100 ms while all threads live
  std::uint16_t ack_seq = 0;
  Code ack_code = Code::Ok;
  Code status_code = Code::Ready;
  std::uint16_t status_detail = 0;
  std::uint16_t active_preset = 0;
  std::uint16_t preset_rev = 0;
  std::uint16_t error_count = 0;
  std::uint32_t uptime_s = 0;
  std::uint32_t frame_count = 0;
  std::uint16_t boot_id = 0;
  PlcRecording recording = PlcRecording::None;
  std::uint64_t result_no = 0;  ///< number of the result this status belongs to; 0 = none (cleared)
  PlcDiagnostics diagnostics;
};

/// The device side of the field bus. on_… are called on the field bus thread between requests; they
/// do not block, allocate or throw.
class PlcCommandSink {
 public:
  virtual ~PlcCommandSink() = default;
  /// Accepted (Code::Accepted), or refused with a 30xx code. Whatever it answers, the field bus
  /// reads `status()` again before the next request is served, so that ACK_SEQ follows the write at
  /// once.
  virtual Code on_command(const PlcCommand& command) noexcept = 0;
  /// The PLC's heartbeat stopped (true) or came back (false).
  virtual void on_heartbeat_lost(bool lost) noexcept = 0;
  /// The PLC wrote ENC_TRIGGER's two registers and no other: a live encoder count at `now_us`.
  virtual void on_encoder(std::uint32_t count, std::int64_t now_us) noexcept {
    (void)count;
    (void)now_us;
  }
  /// The connection that owned the command block died or gave it up.
  virtual void on_control_lost() noexcept = 0;
  /// Newest status and newest latched result; called between requests. Both whole, never torn.
  virtual void read_status(PlcStatus& status) noexcept = 0;
  /// Result number `status.result_no`; called only when that number changed.
  virtual void read_result(PlcResult& result) noexcept = 0;
};

}  // namespace grapnel
