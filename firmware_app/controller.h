#pragma once

#include <cstdint>

#include "base/clock.h"
#include "base/log.h"
#include "firmware_app/encoder_track.h"
#include "firmware_app/job.h"
#include "hal/frame_pool.h"
#include "hal/plc.h"

namespace grapnel {

/// What the controller is told once, at start.
struct ControllerSetup {
  std::uint16_t boot_id = 0;
  bool auto_arm = false;
  Code fault = Code::Ok;          ///< InternalFault after a crash: FAULT until reset
  bool watchdog_restart = false;  ///< the last run was ended by the watchdog
  std::uint32_t build_hash = 0;
  const FramePool* frames = nullptr;  ///< for FRAME_COUNT; nullptr: none
};

/// The device as the PLC sees it: command in, state, flags and latched result out. Runs on the
/// field bus thread alone; everything else reaches it through the Exchange. Nothing here blocks or
/// allocates.
class Controller final : public PlcCommandSink {
 public:
  /// A job is answered this long before its deadline at the latest, so that the answer is read in
  /// time.
  static constexpr std::int64_t kAnswerMarginUs = 5000;

  Controller(const Clock& clock, LogRing& log, Exchange& exchange, const ControllerSetup& setup);

  Code on_command(const PlcCommand& command) noexcept override;
  void on_heartbeat_lost(bool lost) noexcept override;
  void on_encoder(std::uint32_t count, std::int64_t now_us) noexcept override {
    encoder_.add(count, now_us);
  }
  void on_control_lost() noexcept override;
  void read_status(PlcStatus& status) noexcept override;
  void read_result(PlcResult& result) noexcept override;

 private:
  /// What the controller waits for.
  enum class Pending : std::uint8_t { Nothing, Job, Config, SwitchThenJob, Record };

  struct Decision {
    Code code = Code::Accepted;
    std::uint16_t detail = 0;  ///< BadParameter: the register
  };

  [[nodiscard]] Decision judge(const PlcCommand& command) const noexcept;
  [[nodiscard]] Decision judge_parameters(const PlcCommand& command) const noexcept;
  void execute(const PlcCommand& command) noexcept;
  void start_triggered(const PlcCommand& command) noexcept;
  void start_job(JobKind kind, const PlcCommand& command, std::int64_t deadline_us) noexcept;
  void start_config(ConfigAction action, const PlcCommand& command) noexcept;
  void start_record(RecordAction action, const PlcCommand& command) noexcept;
  [[nodiscard]] std::int64_t deadline_of(const PlcCommand& command) const noexcept;

  /// Takes over what the other threads have finished and ends what is past its deadline.
  void advance() noexcept;
  void on_config_answer() noexcept;
  void on_record_state() noexcept;
  void finish_early(Code code) noexcept;
  void cancel_job() noexcept;
  void publish(const PlcResult& result) noexcept;
  void clear_result() noexcept;
  void reset_fault() noexcept;
  void clear_counters() noexcept;

  [[nodiscard]] bool busy() const noexcept { return pending_ != Pending::Nothing; }
  [[nodiscard]] bool sensor_ok() const noexcept {
    return exchange_->health.get().sensor == Code::SensorHealthy;
  }
  [[nodiscard]] PlcState state() const noexcept;
  [[nodiscard]] std::uint16_t flags() const noexcept;
  [[nodiscard]] Code warning() const noexcept;
  void fill_status_code(PlcStatus& status) const noexcept;
  void fill_diagnostics(PlcDiagnostics& diagnostics) const noexcept;

  const Clock* clock_;
  LogRing* log_;
  Exchange* exchange_;
  ControllerSetup setup_;
  std::int64_t started_us_;

  bool armed_ = false;
  bool was_started_ = false;
  bool arm_decided_ = false;  ///< the PLC armed or stopped before the device was up: that stands
  bool heartbeat_lost_ = false;
  bool heartbeat_latched_ = false;  ///< was lost, and nobody has armed since
  bool overrun_ = false;
  Code fault_ = Code::Ok;
  bool watchdog_restart_ = false;

  Pending pending_ = Pending::Nothing;
  PlcCommand command_;  ///< the one being worked off
  JobRequest job_;
  ConfigRequest config_request_;
  RecordRequest record_request_;
  std::int64_t record_deadline_us_ = 0;
  bool has_capture_ = false;
  EncoderTrack encoder_;
  Code config_notice_ = Code::Ok;  ///< 50xx of the last config wish, until one succeeds
  std::uint16_t config_notice_detail_ = 0;

  PlcResult result_;
  std::uint64_t result_no_ = 0;  ///< of the latched result; 0 = none
  std::uint64_t results_ = 0;    ///< published since start
  std::uint16_t ack_seq_ = 0;
  Code ack_code_ = Code::Ok;
  std::uint16_t ack_detail_ = 0;
  std::uint16_t error_count_ = 0;
  std::uint32_t misses_in_a_row_ = 0;
  PlcDiagnostics counters_;  ///< those the controller counts itself
};

}  // namespace grapnel
