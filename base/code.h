// Generated from base/codes.toml by grapnel-codegen. Do not edit.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

namespace grapnel {

/// Outcome of a job, a command or a part of the device, as the field bus reports it.
/// Thousands name the subsystem; hundreds 0 = error, 1 = normal.
enum class Code : std::uint16_t {
  Ok = 0,                         ///< no error; never sent on the field bus
  NoObjectAccepted = 1002,        ///< no object accepted
  RoiEmpty = 1003,                ///< region of interest empty
  TooFewPoints = 1004,            ///< too few points
  TooFewKeypoints = 1005,         ///< too few keypoints
  TooFewCorrespondences = 1006,   ///< too few correspondences
  NoConsensus = 1007,             ///< no consensus
  RefinementDiverged = 1008,      ///< refinement diverged
  BelowFitness = 1009,            ///< below fitness limit
  Ambiguous = 1010,               ///< ambiguous
  FreeSpaceViolated = 1011,       ///< free space violated
  OutsideVolume = 1012,           ///< pose outside allowed volume
  TooMuchUnknown = 1013,          ///< too much unknown data
  UnexplainedForeground = 1014,   ///< unexplained foreground
  NotObservable = 1015,           ///< not observable in a required direction
  HypothesesDisagree = 1016,      ///< hypotheses disagree
  ImplausibleOnBelt = 1017,       ///< implausible on the belt
  ContourDisagrees = 1018,        ///< contour disagrees
  JobDeadline = 1019,             ///< job deadline
  PartsTouch = 1020,              ///< parts touch
  NoSurfaceGrasp = 1021,          ///< no graspable surface
  Aborted = 1023,                 ///< aborted
  ObjectFound = 1100,             ///< object found
  Ready = 1101,                   ///< ready
  CaptureDone = 1102,             ///< capture done
  RoiConfirmedEmpty = 1103,       ///< region of interest confirmed empty
  SurfaceGrasp = 1104,            ///< surface grasp
  SensorNotConnected = 2001,      ///< sensor not connected
  SensorOpening = 2002,           ///< sensor opening
  NoFrameInTime = 2003,           ///< no frame in time
  LostPackets = 2004,             ///< too many lost packets
  WrongSerial = 2005,             ///< wrong serial
  DepthMostlyInvalid = 2006,      ///< depth mostly invalid
  ColorMissing = 2007,            ///< colour missing
  ClockFault = 2008,              ///< clock fault
  SensorMoved = 2009,             ///< sensor moved
  WarmingUp = 2010,               ///< warming up
  SensorHealthy = 2100,           ///< sensor healthy
  UnknownCommand = 3001,          ///< unknown command
  Busy = 3002,                    ///< busy
  NotArmed = 3003,                ///< not armed
  BadParameter = 3004,            ///< bad parameter
  NotAuthorised = 3005,           ///< not authorised
  LocalLock = 3006,               ///< local lock
  HeartbeatLost = 3007,           ///< PLC heartbeat lost
  Accepted = 3100,                ///< accepted
  CalibrationNone = 4001,         ///< no calibration data
  CalibrationOtherSensor = 4002,  ///< calibration of another sensor
  CalibrationFailed = 4003,       ///< calibration verification failed
  CalibrationValid = 4100,        ///< calibration valid
  PresetMissing = 5001,           ///< preset missing
  PresetInvalid = 5002,           ///< preset invalid
  FileUnreadable = 5003,          ///< file unreadable
  RolledBack = 5004,              ///< rolled back
  OverMemoryBudget = 5005,        ///< exceeds memory budget
  ConfigLoaded = 5100,            ///< configuration loaded
  DeadlineMissed = 6001,          ///< deadline missed repeatedly
  MemoryNotLocked = 6002,         ///< real-time rights missing
  HeapUsed = 6003,                ///< heap used after arm
  DiskFull = 6004,                ///< disk full
  WatchdogRestart = 6005,         ///< watchdog restart happened
  OverTemperature = 6006,         ///< over-temperature
  InternalFault = 6007,           ///< internal fault
  CapacityExceeded = 6008,        ///< capacity exceeded
  TargetNotSeen = 7001,           ///< target not seen
  TooFewPoses = 7002,             ///< too few poses
  PosesTooSimilar = 7003,         ///< poses too similar
  ResidualTooLarge = 7004,        ///< residual too large
  PoseStored = 7100,              ///< pose stored
  CalibrationComputed = 7101,     ///< calibration computed
  CalibrationCommitted = 7102,    ///< calibration committed
  FromRecording = 9001,           ///< result from recording
  InjectedFault = 9002,           ///< injected fault active
};

/// One row of the table of codes.
struct CodeEntry {
  Code code;
  std::string_view id;       ///< enumerator's name
  std::string_view text;     ///< short name, as in the register map
  std::string_view meaning;  ///< one sentence
  std::string_view remedy;   ///< what to do; empty for normal codes
};

/// Every code, ascending.
[[nodiscard]] std::span<const CodeEntry> code_table() noexcept;

/// The row of `code`, or the row of InternalFault for a number outside the table.
[[nodiscard]] const CodeEntry& describe(Code code) noexcept;

}  // namespace grapnel
