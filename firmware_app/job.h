#pragma once

#include <array>
#include <atomic>
#include <cstdint>

#include "base/error.h"
#include "base/fixed_list.h"
#include "base/geometry.h"
#include "base/mailbox.h"
#include "base/signal.h"
#include "firmware_app/wakeup.h"
#include "hal/plc.h"

namespace grapnel {

/// Largest number of models in a preset.
inline constexpr std::size_t kMaxModels = 32;

/// What of a model's grasp the answer to the PLC needs.
struct ModelProfile {
  std::uint16_t id = 0;
  std::uint16_t grasp_id = 0;
  Pose model_from_grasp = Pose::Identity();
  Pose grasp_from_pick = Pose::Identity();  ///< pick offset and Z flip of the preset
};

/// What the field bus needs to know of the active preset.
struct PresetInfo {
  std::uint16_t number = 0;  ///< 0 = no preset is active
  std::uint16_t rev = 0;     ///< fingerprint
  std::uint16_t timeout_ms = 500;
  InlineList<std::uint16_t, kMaxModels> model_ids;
};

/// What a job needs beside the frame, fixed when a preset is loaded.
struct JobProfile {
  PresetInfo preset;
  std::uint16_t pose_format = 1;
  std::uint16_t retries = 0;
  InlineList<ModelProfile, kMaxModels> models;
  bool calibrated = false;  ///< robot_from_camera is known
  Pose robot_from_camera = Pose::Identity();
  double max_occupied_share = 0.0;  ///< up to this the region counts as empty (command 61)
};

enum class JobKind : std::uint8_t {
  Register,
  Capture,
  LearnBackground,
  CheckEmpty,
  SelfTest,
  SaveSnapshot
};

/// One job, from the field bus thread to the registration thread.
struct JobRequest {
  std::uint32_t number = 0;  ///< counts jobs since start; 0 = none
  JobKind kind = JobKind::Register;
  PlcCommand command;
  std::int64_t deadline_us = 0;  ///< nothing may be computed past this time
  bool last_capture = false;     ///< use the frame of the job before
  bool with_retries = false;
};

/// What came of a job, from the registration thread to the field bus thread.
struct JobOutcome {
  std::uint32_t number = 0;
  PlcResult result;
  bool has_frame = false;
  std::int64_t exposure_us = 0;              ///< mid-exposure of that frame, host monotonic
  std::array<std::uint32_t, 20> stage_us{};  ///< in Stage's order from Capture
};

enum class JobPhase : std::uint8_t { Idle, Capturing, Processing };

/// The hand-over of jobs between the field bus thread and the registration thread. No locks; at
/// most one job runs, and one more may wait while a cancelled one winds down.
struct JobExchange {
  Latest<JobRequest> request;                 ///< field bus → registration
  Latest<JobOutcome> outcome;                 ///< registration → field bus
  Signal wake;                                ///< of the registration thread
  std::array<std::atomic<bool>, 2> cancel{};  ///< index = job number % 2
  std::atomic<std::uint32_t> finished{0};     ///< number of the last job that left the thread
  std::atomic<JobPhase> phase{JobPhase::Idle};
  /// The calibration belongs to another camera: poses stay in the camera frame.
  std::atomic<bool> foreign_sensor{false};

  [[nodiscard]] std::atomic<bool>& cancel_of(std::uint32_t number) noexcept {
    return cancel[number % 2];
  }
};

enum class ConfigAction : std::uint8_t { None, Select, Check, Reload, LastGood };

/// A wish of the PLC that reads files, from the field bus thread to housekeeping.
struct ConfigRequest {
  std::uint32_t number = 0;  ///< counts wishes since start; 0 = none
  ConfigAction action = ConfigAction::None;
  std::uint16_t preset = 0;  ///< Select, Check: 0 = the active one
};

/// How the configuration stands, from housekeeping to the field bus thread.
struct ConfigState {
  std::uint32_t answered = 0;  ///< number of the last wish that was worked off
  Code answer = Code::Ok;      ///< its outcome: ConfigLoaded or 50xx
  std::uint16_t answer_detail = 0;
  Code state = Code::ConfigLoaded;  ///< what the configuration is now: loaded, refused, rolled back
  std::uint16_t state_detail = 0;
  PresetInfo active;
  bool calibrated = false;
  bool reduced = false;  ///< running on an older configuration than the file
  std::uint32_t reloads = 0;
  std::uint32_t refusals = 0;
};

struct ConfigExchange {
  Latest<ConfigRequest> request;  ///< field bus → housekeeping
  Latest<ConfigState> state;      ///< housekeeping → field bus
};

enum class RecordAction : std::uint8_t { None, Begin, End };

/// A wish of the PLC toward the recorder.
struct RecordRequest {
  std::uint32_t number = 0;  ///< counts wishes since start; 0 = none
  RecordAction action = RecordAction::None;
  std::uint32_t part_tag = 0;
};

/// How the recorder stands.
struct RecordState {
  std::uint32_t answered = 0;  ///< number of the last wish that was worked off
  Code answer = Code::Ok;      ///< its outcome
  PlcRecording phase = PlcRecording::None;
  bool failing = false;  ///< the disk does not take the frames
  std::uint32_t frames = 0;
  std::uint32_t missed = 0;
  std::uint32_t dropped = 0;
};

struct RecordExchange {
  Latest<RecordRequest> request;  ///< field bus → recorder
  Latest<RecordState> state;      ///< recorder → field bus
  Signal wake;                    ///< of the recorder's thread
};

/// How the device is, published by housekeeping every 100 ms.
struct Health {
  bool started = false;  ///< every part is up: the daemon has said READY
  std::uint16_t heartbeat = 0;
  Code sensor = Code::SensorOpening;
  bool live = true;
  bool foreign_sensor = false;    ///< the calibration belongs to another camera
  bool realtime_missing = false;  ///< memory not locked or priority not granted
  std::uint32_t frames = 0;
  std::uint32_t dropped_frames = 0;
  std::uint32_t lost_packets = 0;
  std::uint32_t reconnects = 0;
  std::uint32_t heap_calls = 0;
  std::uint32_t page_faults = 0;
  std::uint32_t serial_hash = 0;
  std::int32_t tilt_mdeg = 0;
  std::int32_t belt_residual_um = 0;
};

/// Everything that crosses threads toward and from the field bus.
struct Exchange {
  JobExchange job;
  ConfigExchange config;
  RecordExchange record;
  Latest<Health> health;
  Wakeup config_wake;  ///< wakes the config thread
};

}  // namespace grapnel
