#include "firmware_app/controller.h"

#include <algorithm>

namespace grapnel {
namespace {

// Register addresses that BadParameter names (STATUS_DETAIL).
constexpr std::uint16_t kRegisterCommand = 1;
constexpr std::uint16_t kRegisterPreset = 2;
constexpr std::uint16_t kRegisterModel = 3;
constexpr std::uint16_t kRegisterMaxObjects = 4;
constexpr std::uint16_t kRegisterOptions = 5;
constexpr std::uint16_t kRegisterPoseFormat = 7;

constexpr std::uint16_t kLastPoseFormat = 7;
constexpr std::uint16_t kKnownOptions = kOptionSnapshotAlways | kOptionSnapshotOnReject |
                                        kOptionCameraFrame | kOptionUseLastCapture | kOptionNoRetry;

// Jobs that no preset times: a background needs some frames, a self test one.
constexpr std::int64_t kLearnTimeoutUs = 5'000'000;
constexpr std::int64_t kSelfTestTimeoutUs = 2'000'000;
// A recording that has not begun or ended by then waits for its disk.
constexpr std::int64_t kRecordTimeoutUs = 2'000'000;

/// Rules of one command.
struct CommandRule {
  PlcCommandCode code;
  bool needs_arm;
  bool while_busy;
  bool in_fault;
};

constexpr CommandRule kRules[] = {
    {PlcCommandCode::Arm, false, false, false},
    {PlcCommandCode::Stop, false, true, true},
    {PlcCommandCode::Register, true, false, false},
    {PlcCommandCode::Capture, true, false, false},
    {PlcCommandCode::RegisterLastCapture, true, false, false},
    {PlcCommandCode::Abort, false, true, true},
    {PlcCommandCode::RegisterWithRetries, true, false, false},
    {PlcCommandCode::ClearResult, false, false, true},
    {PlcCommandCode::SelectPreset, false, false, false},
    {PlcCommandCode::CheckPreset, false, false, true},
    {PlcCommandCode::ReloadConfig, false, false, true},
    {PlcCommandCode::LastGoodConfig, false, false, true},
    {PlcCommandCode::SaveSnapshot, false, false, true},
    {PlcCommandCode::GraspGood, false, false, true},
    {PlcCommandCode::GraspBad, false, false, true},
    {PlcCommandCode::RecordBegin, false, false, true},
    {PlcCommandCode::RecordEnd, false, false, true},
    {PlcCommandCode::LearnBackground, false, false, false},
    {PlcCommandCode::CheckRoiEmpty, false, false, false},
    {PlcCommandCode::SelfTest, false, false, true},
    {PlcCommandCode::ResetFault, false, false, true},
    {PlcCommandCode::ClearCounters, false, true, true},
};

const CommandRule* rule_of(std::uint16_t code) noexcept {
  for (const CommandRule& rule : kRules) {
    if (static_cast<std::uint16_t>(rule.code) == code) return &rule;
  }
  return nullptr;
}

bool is_save(PlcCommandCode code) noexcept {
  return code == PlcCommandCode::SaveSnapshot || code == PlcCommandCode::GraspGood ||
         code == PlcCommandCode::GraspBad;
}

bool is_record(PlcCommandCode code) noexcept {
  return code == PlcCommandCode::RecordBegin || code == PlcCommandCode::RecordEnd;
}

bool is_register(PlcCommandCode code) noexcept {
  return code == PlcCommandCode::Register || code == PlcCommandCode::RegisterLastCapture ||
         code == PlcCommandCode::RegisterWithRetries;
}

bool uses_last_capture(const PlcCommand& command) noexcept {
  const auto code = static_cast<PlcCommandCode>(command.code);
  return code == PlcCommandCode::RegisterLastCapture ||
         (is_register(code) && (command.options & kOptionUseLastCapture) != 0);
}

}  // namespace

Controller::Controller(const Clock& clock, LogRing& log, Exchange& exchange,
                       const ControllerSetup& setup)
    : clock_(&clock),
      log_(&log),
      exchange_(&exchange),
      setup_(setup),
      started_us_(clock.now_us()),
      fault_(setup.fault),
      watchdog_restart_(setup.watchdog_restart) {}

Code Controller::on_command(const PlcCommand& command) noexcept {
  advance();
  ack_detail_ = 0;
  if (command.seq == 0) {
    ack_seq_ = 0;
    ack_code_ = Code::Ok;
    return Code::Ok;
  }
  const Decision decision = judge(command);
  ack_seq_ = command.seq;
  ack_code_ = decision.code;
  ack_detail_ = decision.detail;
  if (decision.code != Code::Accepted) {
    ++error_count_;
    if (decision.code == Code::Busy) {
      overrun_ = true;
      ++counters_.overruns;
    }
    log_->push(LogLevel::Warning, Stage::FieldBus, decision.code, "command {} refused, detail {}",
               command.code, decision.detail);
    return decision.code;
  }
  overrun_ = false;
  execute(command);
  return Code::Accepted;
}

Controller::Decision Controller::judge(const PlcCommand& command) const noexcept {
  const CommandRule* rule = rule_of(command.code);
  if (rule == nullptr) return {Code::UnknownCommand, 0};
  const bool arming = rule->code == PlcCommandCode::Arm;
  if (heartbeat_lost_ && (rule->needs_arm || arming)) return {Code::HeartbeatLost, 0};
  if (busy() && !rule->while_busy) return {Code::Busy, 0};
  // A cancelled job may still wind down beside one new job, not beside two.
  const bool starts_job = rule->needs_arm || rule->code == PlcCommandCode::LearnBackground ||
                          rule->code == PlcCommandCode::CheckRoiEmpty ||
                          rule->code == PlcCommandCode::SelfTest || is_save(rule->code);
  if (starts_job && exchange_->job.finished.load(std::memory_order_acquire) + 1 < job_.number) {
    return {Code::Busy, 0};
  }
  if (fault_ != Code::Ok && !rule->in_fault) return {Code::NotArmed, 0};
  if (rule->needs_arm && !armed_) return {Code::NotArmed, 0};
  return judge_parameters(command);
}

Controller::Decision Controller::judge_parameters(const PlcCommand& command) const noexcept {
  const auto code = static_cast<PlcCommandCode>(command.code);
  if ((command.options & ~kKnownOptions) != 0) return {Code::BadParameter, kRegisterOptions};
  if (code == PlcCommandCode::SelectPreset && command.preset_id == 0) {
    return {Code::BadParameter, kRegisterPreset};
  }
  if (code == PlcCommandCode::SelectPreset || code == PlcCommandCode::CheckPreset ||
      code == PlcCommandCode::ReloadConfig || code == PlcCommandCode::LastGoodConfig ||
      is_register(code)) {
    // One wish at a time is with housekeeping.
    const bool waits = exchange_->config.state.get().answered != config_request_.number;
    const bool switches =
        command.preset_id != 0 && command.preset_id != exchange_->config.state.get().active.number;
    if (waits && (!is_register(code) || switches)) return {Code::Busy, 0};
  }
  const bool recorder_waits = exchange_->record.state.get().answered != record_request_.number;
  if (is_record(code) && recorder_waits) return {Code::Busy, 0};
  if (!is_register(code)) return {};
  if (command.max_objects > kMaxObjects) return {Code::BadParameter, kRegisterMaxObjects};
  if (command.pose_format > kLastPoseFormat) return {Code::BadParameter, kRegisterPoseFormat};
  const PresetInfo& active = exchange_->config.state.get().active;
  const bool keeps = command.preset_id == 0 || command.preset_id == active.number;
  if (command.model_id != 0 && keeps &&
      std::find(active.model_ids.begin(), active.model_ids.end(), command.model_id) ==
          active.model_ids.end()) {
    return {Code::BadParameter, kRegisterModel};
  }
  if (uses_last_capture(command) && !has_capture_) {
    const bool by_option = code != PlcCommandCode::RegisterLastCapture;
    return {Code::BadParameter, by_option ? kRegisterOptions : kRegisterCommand};
  }
  return {};
}

void Controller::execute(const PlcCommand& command) noexcept {
  const auto code = static_cast<PlcCommandCode>(command.code);
  const std::int64_t now_us = command.accepted_us;
  arm_decided_ = arm_decided_ || code == PlcCommandCode::Arm || code == PlcCommandCode::Stop;
  if (busy() && (code == PlcCommandCode::Stop || code == PlcCommandCode::Abort)) {
    finish_early(Code::Aborted);
    if (code == PlcCommandCode::Stop) armed_ = false;
    return;
  }
  if (!busy()) clear_result();
  if (!busy()) command_ = command;
  switch (code) {
    case PlcCommandCode::Arm:
      armed_ = true;
      heartbeat_latched_ = false;
      break;
    case PlcCommandCode::Stop:
      armed_ = false;
      break;
    case PlcCommandCode::Register:
    case PlcCommandCode::RegisterLastCapture:
    case PlcCommandCode::RegisterWithRetries:
      start_triggered(command);
      break;
    case PlcCommandCode::Capture:
      start_job(JobKind::Capture, command, deadline_of(command));
      break;
    case PlcCommandCode::CheckRoiEmpty:
      start_job(JobKind::CheckEmpty, command, deadline_of(command));
      break;
    case PlcCommandCode::LearnBackground:
      start_job(JobKind::LearnBackground, command, now_us + kLearnTimeoutUs);
      break;
    case PlcCommandCode::SelfTest:
      start_job(JobKind::SelfTest, command, now_us + kSelfTestTimeoutUs);
      break;
    case PlcCommandCode::SaveSnapshot:
    case PlcCommandCode::GraspGood:
    case PlcCommandCode::GraspBad:
      start_job(JobKind::SaveSnapshot, command, now_us + kSelfTestTimeoutUs);
      break;
    case PlcCommandCode::RecordBegin:
      start_record(RecordAction::Begin, command);
      break;
    case PlcCommandCode::RecordEnd:
      start_record(RecordAction::End, command);
      break;
    case PlcCommandCode::SelectPreset:
      start_config(ConfigAction::Select, command);
      break;
    case PlcCommandCode::CheckPreset:
      start_config(ConfigAction::Check, command);
      break;
    case PlcCommandCode::ReloadConfig:
      start_config(ConfigAction::Reload, command);
      break;
    case PlcCommandCode::LastGoodConfig:
      start_config(ConfigAction::LastGood, command);
      break;
    case PlcCommandCode::ResetFault:
      reset_fault();
      break;
    case PlcCommandCode::ClearCounters:
      clear_counters();
      break;
    default:
      break;  // Abort and ClearResult have nothing more to do
  }
}

std::int64_t Controller::deadline_of(const PlcCommand& command) const noexcept {
  const std::uint16_t timeout_ms = command.timeout_ms != 0
                                       ? command.timeout_ms
                                       : exchange_->config.state.get().active.timeout_ms;
  return command.accepted_us + std::int64_t{timeout_ms} * 1000;
}

void Controller::start_triggered(const PlcCommand& command) noexcept {
  const PresetInfo& active = exchange_->config.state.get().active;
  if (command.preset_id != 0 && command.preset_id != active.number) {
    start_config(ConfigAction::Select, command);
    pending_ = Pending::SwitchThenJob;
    job_.deadline_us = deadline_of(command);
    return;
  }
  start_job(JobKind::Register, command, deadline_of(command));
}

void Controller::start_job(JobKind kind, const PlcCommand& command,
                           std::int64_t deadline_us) noexcept {
  const auto code = static_cast<PlcCommandCode>(command.code);
  ++job_.number;
  job_.kind = kind;
  job_.command = command;
  job_.deadline_us = deadline_us;
  job_.last_capture = uses_last_capture(command);
  job_.with_retries =
      code == PlcCommandCode::RegisterWithRetries && (command.options & kOptionNoRetry) == 0;
  pending_ = Pending::Job;
  ++counters_.jobs;
  exchange_->job.cancel_of(job_.number).store(false, std::memory_order_release);
  exchange_->job.request.publish(job_);
  exchange_->job.wake.notify();
}

void Controller::start_config(ConfigAction action, const PlcCommand& command) noexcept {
  ++config_request_.number;
  config_request_.action = action;
  config_request_.preset = command.preset_id;
  pending_ = Pending::Config;
  exchange_->config.request.publish(config_request_);
  exchange_->config_wake.notify();
}

void Controller::start_record(RecordAction action, const PlcCommand& command) noexcept {
  ++record_request_.number;
  record_request_.action = action;
  record_request_.part_tag = command.part_tag;
  record_deadline_us_ = command.accepted_us + kRecordTimeoutUs;
  pending_ = Pending::Record;
  exchange_->record.request.publish(record_request_);
  exchange_->record.wake.notify();
}

void Controller::on_heartbeat_lost(bool lost) noexcept {
  if (lost && !heartbeat_lost_) {
    if (busy()) cancel_job();
    clear_result();
    armed_ = false;
    heartbeat_latched_ = true;
    ++error_count_;
    log_->push(LogLevel::Warning, Stage::FieldBus, Code::HeartbeatLost, "PLC heartbeat lost");
  }
  heartbeat_lost_ = lost;
}

void Controller::on_control_lost() noexcept {
  // A PLC that reconnects finds its job and its latched result; one that stays away is the
  // heartbeat's business.
  log_->push(LogLevel::Info, Stage::FieldBus, Code::Ok, "control connection closed");
}

void Controller::cancel_job() noexcept {
  if (pending_ == Pending::Job) {
    exchange_->job.cancel_of(job_.number).store(true, std::memory_order_release);
    exchange_->job.wake.notify();
  }
  pending_ = Pending::Nothing;
}

void Controller::reset_fault() noexcept {
  fault_ = Code::Ok;
  watchdog_restart_ = false;
  misses_in_a_row_ = 0;
  config_notice_ = Code::Ok;
}

void Controller::clear_counters() noexcept {
  counters_ = {};
  error_count_ = 0;
}

}  // namespace grapnel
