#include <gtest/gtest.h>

#include <array>
#include <memory>
#include <optional>

#include "base/rng.h"
#include "firmware_app/controller.h"

namespace grapnel {
namespace {

constexpr std::int64_t kStartUs = 1'000'000;
constexpr std::uint16_t kPresetTimeoutMs = 500;
constexpr int kSteps = 60'000;

constexpr std::array kCommands = {
    PlcCommandCode::Arm,           PlcCommandCode::Stop,
    PlcCommandCode::Register,      PlcCommandCode::Register,
    PlcCommandCode::Register,      PlcCommandCode::Capture,
    PlcCommandCode::Abort,         PlcCommandCode::RegisterLastCapture,
    PlcCommandCode::ClearResult,   PlcCommandCode::RegisterWithRetries,
    PlcCommandCode::SelectPreset,  PlcCommandCode::CheckPreset,
    PlcCommandCode::ReloadConfig,  PlcCommandCode::LastGoodConfig,
    PlcCommandCode::SaveSnapshot,  PlcCommandCode::LearnBackground,
    PlcCommandCode::CheckRoiEmpty, PlcCommandCode::SelfTest,
    PlcCommandCode::GraspGood,     PlcCommandCode::GraspBad,
    PlcCommandCode::RecordBegin,   PlcCommandCode::RecordEnd,
    PlcCommandCode::ResetFault,    PlcCommandCode::ClearCounters,
};

/// A PLC, a registration thread and a config thread that do anything at any time. After every step
/// the registers must keep the promises a PLC programmer relies on.
class Storm {
 public:
  explicit Storm(std::uint64_t seed)
      : rng_(seed), controller_(clock_, log_, exchange_, {.boot_id = 1, .auto_arm = true}) {
    health_.sensor = Code::SensorHealthy;
    exchange_.health.publish(health_);
    config_.active.number = 11;
    config_.active.timeout_ms = kPresetTimeoutMs;
    exchange_.config.state.publish(config_);
  }

  void step() {
    clock_.advance_us(rng_.below(40'000));
    switch (rng_.below(8)) {
      case 0:
      case 1:
        command();
        break;
      case 2:
      case 3:
      case 4:
        registration_thread();
        break;
      case 5:
        config_thread();
        break;
      case 6:
        if (rng_.below(20) == 0) heartbeat();
        break;
      default:
        if (rng_.below(20) == 0) housekeeping();
    }
    check();
  }

  [[nodiscard]] int accepted_poses() const { return accepted_poses_; }

 private:
  void command() {
    PlcCommand command;
    command.seq =
        static_cast<std::uint16_t>(rng_.below(8) == 0 ? rng_.below(4) : ++seq_ % 65535 + 1);
    command.code = rng_.below(30) == 0
                       ? static_cast<std::uint16_t>(rng_.below(100))
                       : static_cast<std::uint16_t>(kCommands[rng_.below(kCommands.size())]);
    command.preset_id = rng_.below(4) == 0 ? static_cast<std::uint16_t>(11 + rng_.below(3)) : 0;
    command.timeout_ms = rng_.below(3) == 0 ? static_cast<std::uint16_t>(rng_.below(700)) : 0;
    command.max_objects = static_cast<std::uint16_t>(rng_.below(10));
    command.options = static_cast<std::uint16_t>(rng_.below(40));
    command.accepted_us = clock_.now_us();
    const PlcStatus before = status();
    const Code answer = controller_.on_command(command);
    if (command.seq == 0) return;
    const PlcStatus after = status();
    EXPECT_EQ(after.ack_seq, command.seq);
    EXPECT_EQ(after.ack_code, answer);
    const bool was_busy = (before.flags & kFlagBusy) != 0;
    if (answer != Code::Accepted) {
      EXPECT_EQ(after.result_no, before.result_no) << "a refused command took the result away";
      return;
    }
    if (!was_busy) owner_ = command;
    if (command.code == static_cast<std::uint16_t>(PlcCommandCode::Arm)) lost_since_arm_ = false;
  }

  /// Takes the newest job; ends it with any outcome, or when it is cancelled; or lets it hang.
  void registration_thread() {
    if (!job_) {
      if (!exchange_.job.request.update()) return;
      job_ = exchange_.job.request.get();
      exchange_.job.phase.store(JobPhase::Capturing);
      return;
    }
    if (exchange_.job.phase.load() == JobPhase::Capturing && rng_.below(2) == 0) {
      exchange_.job.phase.store(JobPhase::Processing);
      return;
    }
    const bool cancelled = exchange_.job.cancel_of(job_->number).load();
    if (!cancelled && rng_.below(2) == 0) return;
    JobOutcome outcome;
    outcome.number = job_->number;
    outcome.has_frame = rng_.below(2) == 0;
    outcome.result.cmd_seq = job_->command.seq;
    outcome.result.part_tag = job_->command.part_tag;
    outcome.result.code = cancelled ? Code::Aborted : Code::BelowFitness;
    if (!cancelled && rng_.below(2) == 0) {
      PlcObject object;
      object.accepted = true;
      object.code = Code::ObjectFound;
      outcome.result.objects.push_back(object);
      outcome.result.code = Code::ObjectFound;
    }
    exchange_.job.outcome.publish(outcome);
    exchange_.job.finished.store(job_->number);
    exchange_.job.phase.store(JobPhase::Idle);
    job_.reset();
  }

  void recorder_thread() {
    exchange_.record.request.update();
    record_.answered = exchange_.record.request.get().number;
    record_.answer = rng_.below(3) == 0 ? Code::DiskFull : Code::CaptureDone;
    exchange_.record.state.publish(record_);
  }

  void config_thread() {
    if (rng_.below(2) == 0) recorder_thread();
    exchange_.config.request.update();
    const ConfigRequest& wish = exchange_.config.request.get();
    if (wish.number == config_.answered) return;
    config_.answered = wish.number;
    config_.answer = rng_.below(3) == 0 ? Code::PresetInvalid : Code::ConfigLoaded;
    if (config_.answer == Code::ConfigLoaded && wish.action == ConfigAction::Select) {
      config_.active.number = wish.preset;
    }
    exchange_.config.state.publish(config_);
  }

  void heartbeat() {
    heartbeat_lost_ = !heartbeat_lost_;
    lost_since_arm_ = lost_since_arm_ || heartbeat_lost_;
    controller_.on_heartbeat_lost(heartbeat_lost_);
    if (heartbeat_lost_) {
      const PlcStatus now = status();
      EXPECT_EQ(now.flags & (kFlagBusy | kFlagDone | kFlagResultValid | kFlagReady), 0);
    }
  }

  void housekeeping() {
    health_.started = true;
    health_.sensor = rng_.below(3) == 0 ? Code::SensorNotConnected : Code::SensorHealthy;
    exchange_.health.publish(health_);
  }

  PlcStatus status() {
    PlcStatus status;
    controller_.read_status(status);
    if (status.result_no != seen_result_) note_result(status.result_no);
    return status;
  }

  void note_result(std::uint64_t number) {
    seen_result_ = number;
    published_us_ = clock_.now_us();
  }

  void check() {
    const PlcStatus now = status();
    const bool busy = (now.flags & kFlagBusy) != 0;
    const bool done = (now.flags & kFlagDone) != 0;
    const bool valid = (now.flags & kFlagResultValid) != 0;
    const bool ready = (now.flags & kFlagReady) != 0;
    EXPECT_FALSE(busy && done) << "a result of another command beside a running one";
    EXPECT_FALSE(busy && ready);
    EXPECT_FALSE(valid && !done);
    EXPECT_FALSE(ready && lost_since_arm_) << "ready without arming again";
    EXPECT_EQ(done, now.result_no != 0);
    EXPECT_LE(exchange_.job.request.get().number, exchange_.job.finished.load() + 2);
    if (!done) return;
    PlcResult result;
    controller_.read_result(result);
    EXPECT_EQ(result.cmd_seq, owner_.seq) << "the answer to another command";
    if (!valid) return;
    ++accepted_poses_;
    EXPECT_EQ(result.code, Code::ObjectFound);
    ASSERT_FALSE(result.objects.empty());
    EXPECT_TRUE(result.objects[0].accepted);
    EXPECT_LT(published_us_, owner_.accepted_us + longest_us(owner_)) << "a late pose";
  }

  static std::int64_t longest_us(const PlcCommand& command) {
    switch (static_cast<PlcCommandCode>(command.code)) {
      case PlcCommandCode::LearnBackground:
        return 5'000'000;
      case PlcCommandCode::SelfTest:
      case PlcCommandCode::SaveSnapshot:
      case PlcCommandCode::GraspGood:
      case PlcCommandCode::GraspBad:
        return 2'000'000;
      default:
        return std::int64_t{command.timeout_ms != 0 ? command.timeout_ms : kPresetTimeoutMs} * 1000;
    }
  }

  Rng rng_;
  ManualClock clock_{kStartUs};
  LogRing log_{clock_};
  Exchange exchange_;
  Controller controller_;
  Health health_;
  ConfigState config_;
  RecordState record_;
  std::optional<JobRequest> job_;
  PlcCommand owner_;
  std::uint16_t seq_ = 0;
  bool heartbeat_lost_ = false;
  bool lost_since_arm_ = false;
  std::uint64_t seen_result_ = 0;
  std::int64_t published_us_ = 0;
  int accepted_poses_ = 0;
};

TEST(ControllerStorm, KeepsItsPromisesWhateverEverybodyDoes) {
  int accepted_poses = 0;
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    Storm storm(seed);
    for (int i = 0; i < kSteps && !testing::Test::HasFailure(); ++i) storm.step();
    EXPECT_FALSE(testing::Test::HasFailure()) << "seed " << seed;
    accepted_poses += storm.accepted_poses();
  }
  // The storm is no use when it never gets that far.
  EXPECT_GT(accepted_poses, 100);
}

}  // namespace
}  // namespace grapnel
