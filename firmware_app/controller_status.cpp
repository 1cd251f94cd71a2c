#include <algorithm>

#include "firmware_app/controller.h"

namespace grapnel {
namespace {

// This many jobs in a row past their deadline are worth a warning.
constexpr std::uint32_t kRepeatedMisses = 3;

bool is_error(Code code) noexcept {
  const auto number = static_cast<std::uint16_t>(code);
  return number != 0 && number / 100 % 10 == 0;
}

/// The device works, the part does not pass.
bool is_rejection(Code code) noexcept {
  return static_cast<std::uint16_t>(code) / 100 == 10 && code != Code::JobDeadline &&
         code != Code::Aborted;
}

/// A sensor in this state sees something else, or elsewhere, than what it was set up for: its poses
/// are not true.
bool spoils_poses(Code sensor) noexcept {
  return sensor == Code::SensorMoved || sensor == Code::WarmingUp || sensor == Code::WrongSerial ||
         sensor == Code::ClockFault;
}

}  // namespace

void Controller::advance() noexcept {
  exchange_->health.update();
  if (exchange_->health.get().started && !was_started_) {
    was_started_ = true;
    if (!arm_decided_) armed_ = setup_.auto_arm && fault_ == Code::Ok && !heartbeat_latched_;
  }
  exchange_->config.state.update();
  const bool awaits_config = pending_ == Pending::Config || pending_ == Pending::SwitchThenJob;
  if (awaits_config && exchange_->config.state.get().answered == config_request_.number) {
    on_config_answer();
  }
  on_record_state();
  const bool fresh = exchange_->job.outcome.update();
  const JobOutcome& outcome = exchange_->job.outcome.get();
  if (fresh && outcome.has_frame) has_capture_ = true;
  const bool timed = pending_ == Pending::Job || pending_ == Pending::SwitchThenJob;
  // Never a late pose: what arrives past the deadline is answered as late.
  if (timed && clock_->now_us() >= job_.deadline_us - kAnswerMarginUs &&
      !(fresh && outcome.number == job_.number && clock_->now_us() < job_.deadline_us)) {
    finish_early(Code::JobDeadline);
    return;
  }
  if (pending_ != Pending::Job || !fresh || outcome.number != job_.number) return;
  pending_ = Pending::Nothing;
  counters_.stage_us = outcome.stage_us;
  counters_.worst_job_us = std::max(counters_.worst_job_us, outcome.result.total_us);
  PlcResult result = outcome.result;
  if (outcome.has_frame) {
    result.enc_capture = encoder_.at(outcome.exposure_us).value_or(result.enc_capture);
  }
  const Code sensor = exchange_->health.get().sensor;
  if (spoils_poses(sensor) && !result.objects.empty()) {
    result.objects.clear();
    result.code = sensor;
  }
  publish(result);
}

void Controller::on_config_answer() noexcept {
  const ConfigState& config = exchange_->config.state.get();
  const bool loaded = config.answer == Code::ConfigLoaded || config.answer == Code::RolledBack;
  if (config_request_.action != ConfigAction::Check) {
    config_notice_ = loaded ? Code::Ok : config.answer;
    config_notice_detail_ = loaded ? std::uint16_t{0} : config.answer_detail;
  }
  if (pending_ == Pending::SwitchThenJob && loaded) {
    start_job(JobKind::Register, command_, deadline_of(command_));
    return;
  }
  pending_ = Pending::Nothing;
  PlcResult result;
  result.cmd_seq = command_.seq;
  result.code = config.answer;
  result.part_tag = command_.part_tag;
  result.enc_capture = command_.enc_trigger;
  result.preset = config.active.number;
  result.preset_rev = config.active.rev;
  publish(result);
}

void Controller::on_record_state() noexcept {
  exchange_->record.state.update();
  if (pending_ != Pending::Record) return;
  const RecordState& state = exchange_->record.state.get();
  const bool answered = state.answered == record_request_.number;
  if (answered || clock_->now_us() >= record_deadline_us_) {
    finish_early(answered ? state.answer : Code::Busy);
  }
}

void Controller::finish_early(Code code) noexcept {
  const bool was_job = pending_ == Pending::Job || pending_ == Pending::SwitchThenJob;
  cancel_job();
  PlcResult result;
  result.cmd_seq = command_.seq;
  result.code = code;
  result.part_tag = command_.part_tag;
  result.enc_capture = command_.enc_trigger;
  result.preset = exchange_->config.state.get().active.number;
  result.preset_rev = exchange_->config.state.get().active.rev;
  if (was_job) {
    result.total_us = static_cast<std::uint32_t>(
        std::max<std::int64_t>(0, clock_->now_us() - command_.accepted_us));
  }
  publish(result);
}

void Controller::publish(const PlcResult& result) noexcept {
  result_ = result;
  result_no_ = ++results_;
  if (is_error(result.code)) {
    if (!is_rejection(result.code)) ++error_count_;  // a rejected part is no error
  }
  if (result.code == Code::JobDeadline) {
    ++counters_.deadlines_missed;
    ++misses_in_a_row_;
    log_->push(LogLevel::Warning, Stage::Publish, result.code, "job {} missed its deadline",
               job_.number);
    return;
  }
  misses_in_a_row_ = 0;
  const bool accepted = !result.objects.empty() && result.objects[0].has_pose();
  const bool rejected = is_rejection(result.code);
  if (accepted) ++counters_.jobs_accepted;
  if (rejected) ++counters_.jobs_rejected;
  log_->push(LogLevel::Info, Stage::Publish, result.code, "result {} for command token {}, {} us",
             static_cast<std::int64_t>(result_no_), result.cmd_seq, result.total_us);
}

void Controller::clear_result() noexcept { result_no_ = 0; }

void Controller::read_result(PlcResult& result) noexcept { result = result_; }

void Controller::read_status(PlcStatus& status) noexcept {
  advance();
  const ConfigState& config = exchange_->config.state.get();
  const Health& health = exchange_->health.get();
  status.state = state();
  status.flags = flags();
  status.heartbeat = health.heartbeat;
  status.ack_seq = ack_seq_;
  status.ack_code = ack_code_;
  status.active_preset = config.active.number;
  status.preset_rev = config.active.rev;
  status.error_count = error_count_;
  status.uptime_s = static_cast<std::uint32_t>((clock_->now_us() - started_us_) / 1'000'000);
  status.frame_count =
      setup_.frames != nullptr ? static_cast<std::uint32_t>(setup_.frames->published()) : 0U;
  status.boot_id = setup_.boot_id;
  status.recording = exchange_->record.state.get().phase;
  status.result_no = result_no_;
  fill_status_code(status);
  fill_diagnostics(status.diagnostics);
}

PlcState Controller::state() const noexcept {
  if (!exchange_->health.get().started) return PlcState::Boot;
  if (fault_ != Code::Ok) return PlcState::Fault;
  if (pending_ == Pending::Job) {
    return exchange_->job.phase.load(std::memory_order_acquire) == JobPhase::Processing
               ? PlcState::Processing
               : PlcState::Capturing;
  }
  if (busy()) return PlcState::Processing;
  if (!sensor_ok()) return PlcState::Fault;
  if (result_no_ != 0) return PlcState::Result;
  return armed_ ? PlcState::Ready : PlcState::Stopped;
}

std::uint16_t Controller::flags() const noexcept {
  const ConfigState& config = exchange_->config.state.get();
  const Health& health = exchange_->health.get();
  const bool preset_ok = config.active.number != 0;
  const bool valid = result_no_ != 0 && !result_.objects.empty() && result_.objects[0].has_pose();
  const bool fault = fault_ != Code::Ok || !sensor_ok() || heartbeat_latched_ || !preset_ok;
  const bool ready =
      health.started && armed_ && !busy() && sensor_ok() && preset_ok && fault_ == Code::Ok;
  unsigned bits = 0;
  const auto set = [&bits](std::uint16_t flag, bool on) {
    if (on) bits |= flag;
  };
  set(kFlagReady, ready);
  set(kFlagBusy, busy());
  set(kFlagDone, result_no_ != 0);
  set(kFlagResultValid, valid);
  set(kFlagError, health.started && fault);
  set(kFlagWarning, warning() != Code::Ok || is_error(config_notice_) || is_error(config.state));
  set(kFlagSensorOk, sensor_ok());
  set(kFlagCalibOk, config.calibrated && !health.foreign_sensor);
  set(kFlagPresetOk, preset_ok);
  set(kFlagReplay, !health.live);
  set(kFlagHeartbeatLost, heartbeat_lost_);
  set(kFlagOverrun, overrun_);
  set(kFlagReduced, config.reduced);
  return static_cast<std::uint16_t>(bits);
}

Code Controller::warning() const noexcept {
  const Health& health = exchange_->health.get();
  if (misses_in_a_row_ >= kRepeatedMisses) return Code::DeadlineMissed;
  if (health.heap_calls != 0) return Code::HeapUsed;
  if (watchdog_restart_) return Code::WatchdogRestart;
  if (exchange_->record.state.get().failing) return Code::DiskFull;
  if (health.realtime_missing) return Code::MemoryNotLocked;
  return Code::Ok;
}

void Controller::fill_status_code(PlcStatus& status) const noexcept {
  const ConfigState& config = exchange_->config.state.get();
  const Health& health = exchange_->health.get();
  status.status_detail = 0;
  if (fault_ != Code::Ok) {
    status.status_code = fault_;
  } else if (heartbeat_lost_ || heartbeat_latched_) {
    status.status_code = Code::HeartbeatLost;
  } else if (!sensor_ok()) {
    status.status_code = health.sensor;
  } else if (is_error(config_notice_)) {
    status.status_code = config_notice_;
    status.status_detail = config_notice_detail_;
  } else if (is_error(config.state)) {
    status.status_code = config.state;
    status.status_detail = config.state_detail;
  } else if (config.calibrated && health.foreign_sensor) {
    status.status_code = Code::CalibrationOtherSensor;
  } else if (warning() != Code::Ok) {
    status.status_code = warning();
  } else {
    status.status_code = armed_ ? Code::Ready : Code::NotArmed;
  }
  if (ack_code_ == Code::BadParameter) status.status_detail = ack_detail_;
}

void Controller::fill_diagnostics(PlcDiagnostics& diagnostics) const noexcept {
  const ConfigState& config = exchange_->config.state.get();
  const Health& health = exchange_->health.get();
  diagnostics = counters_;
  diagnostics.frames = health.frames;
  diagnostics.dropped_frames = health.dropped_frames;
  diagnostics.lost_packets = health.lost_packets;
  diagnostics.reconnects = health.reconnects;
  diagnostics.heap_calls = health.heap_calls;
  diagnostics.page_faults = health.page_faults;
  diagnostics.config_reloads = config.reloads;
  diagnostics.config_refusals = config.refusals;
  diagnostics.serial_hash = health.serial_hash;
  diagnostics.tilt_mdeg = health.tilt_mdeg;
  diagnostics.belt_residual_um = health.belt_residual_um;
  diagnostics.build_hash = setup_.build_hash;
  const RecordState& record = exchange_->record.state.get();
  diagnostics.record_frames = record.frames;
  diagnostics.record_missed = record.missed;
  diagnostics.record_dropped = record.dropped;
}

}  // namespace grapnel
