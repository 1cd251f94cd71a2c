#include "firmware_app/controller.h"

#include <gtest/gtest.h>

#include <memory>

namespace grapnel {
namespace {

constexpr std::int64_t kStartUs = 1'000'000;

/// The field bus, the registration thread and housekeeping, all played by the test.
class ControllerTest : public ::testing::Test {
 protected:
  ControllerTest() { build({.boot_id = 77, .auto_arm = true}); }

  void build(const ControllerSetup& setup) {
    exchange_ = std::make_unique<Exchange>();
    controller_ = std::make_unique<Controller>(clock_, log_, *exchange_, setup);
    health_ = {};
    health_.started = true;
    health_.sensor = Code::SensorHealthy;
    exchange_->health.publish(health_);
    config_ = {};
    config_.active.number = 11;
    config_.active.rev = 4711;
    config_.active.timeout_ms = 500;
    config_.active.model_ids.push_back(3);
    exchange_->config.state.publish(config_);
  }

  Code send(PlcCommandCode code, PlcCommand command = {}) {
    command.seq = ++seq_;
    command.code = static_cast<std::uint16_t>(code);
    command.accepted_us = clock_.now_us();
    return controller_->on_command(command);
  }
  PlcStatus status() {
    PlcStatus status;
    controller_->read_status(status);
    return status;
  }
  PlcResult result() {
    PlcResult result;
    controller_->read_result(result);
    return result;
  }
  bool flag(std::uint16_t bit) { return (status().flags & bit) != 0; }

  /// What the registration thread would find; false when no new job was handed over.
  bool take_job() { return exchange_->job.request.update(); }
  const JobRequest& job() { return exchange_->job.request.get(); }
  void finish_job(Code code, bool accepted = false, std::int64_t exposure_us = 0) {
    JobOutcome outcome;
    outcome.number = job().number;
    outcome.has_frame = true;
    outcome.exposure_us = exposure_us;
    outcome.result.cmd_seq = job().command.seq;
    outcome.result.enc_capture = job().command.enc_trigger;
    outcome.result.code = code;
    if (accepted) {
      PlcObject object;
      object.accepted = true;
      object.code = Code::ObjectFound;
      outcome.result.objects.push_back(object);
    }
    exchange_->job.outcome.publish(outcome);
    exchange_->job.finished.store(job().number);
  }
  bool take_wish() { return exchange_->config.request.update(); }
  const ConfigRequest& wish() { return exchange_->config.request.get(); }
  void answer_wish(Code code, std::uint16_t active) {
    config_.answered = wish().number;
    config_.answer = code;
    config_.active.number = active;
    exchange_->config.state.publish(config_);
  }

  ManualClock clock_{kStartUs};
  LogRing log_{clock_};
  std::unique_ptr<Exchange> exchange_;
  std::unique_ptr<Controller> controller_;
  Health health_;
  ConfigState config_;
  std::uint16_t seq_ = 0;
};

TEST_F(ControllerTest, IsReadyOnceStartedAndArmed) {
  const PlcStatus now = status();
  EXPECT_EQ(now.state, PlcState::Ready);
  EXPECT_EQ(now.status_code, Code::Ready);
  EXPECT_EQ(now.boot_id, 77);
  EXPECT_EQ(now.active_preset, 11);
  EXPECT_EQ(now.preset_rev, 4711);
  EXPECT_EQ(now.flags, kFlagReady | kFlagSensorOk | kFlagPresetOk);
}

TEST_F(ControllerTest, StaysInBootUntilEveryPartIsUp) {
  health_.started = false;
  exchange_->health.publish(health_);
  EXPECT_EQ(status().state, PlcState::Boot);
  EXPECT_FALSE(flag(kFlagReady));
  EXPECT_EQ(send(PlcCommandCode::Register), Code::NotArmed);
}

TEST_F(ControllerTest, WhatThePlcSaysOfArmingDuringBootStands) {
  for (const PlcCommandCode code : {PlcCommandCode::Arm, PlcCommandCode::Stop}) {
    // Each against what the configuration would do by itself.
    build({.boot_id = 77, .auto_arm = code == PlcCommandCode::Stop});
    health_.started = false;
    exchange_->health.publish(health_);
    EXPECT_EQ(send(code), Code::Accepted);
    health_.started = true;
    exchange_->health.publish(health_);
    EXPECT_EQ(flag(kFlagReady), code == PlcCommandCode::Arm);
  }
}

TEST_F(ControllerTest, DoesNotArmItselfOverAHeartbeatLostDuringBoot) {
  health_.started = false;
  exchange_->health.publish(health_);
  controller_->on_heartbeat_lost(true);
  health_.started = true;
  exchange_->health.publish(health_);
  EXPECT_FALSE(flag(kFlagReady));
  controller_->on_heartbeat_lost(false);
  EXPECT_FALSE(flag(kFlagReady));
  EXPECT_EQ(send(PlcCommandCode::Arm), Code::Accepted);
  EXPECT_TRUE(flag(kFlagReady));
}

TEST_F(ControllerTest, ReadsTheStreamedEncoderAtMidExposure) {
  for (std::uint32_t i = 0; i < 6; ++i) {
    controller_->on_encoder(1000 + 100 * i, kStartUs + 20'000 * i);
  }
  send(PlcCommandCode::Register, {.enc_trigger = 7});
  ASSERT_TRUE(take_job());
  finish_job(Code::ObjectFound, true, kStartUs + 50'000);
  status();
  EXPECT_EQ(result().enc_capture, 1250U);  // 100 counts in 20 ms, half of the way
}

TEST_F(ControllerTest, GivesTheTriggersCountWhereNoneIsStreamed) {
  controller_->on_encoder(1000, kStartUs);
  send(PlcCommandCode::Register, {.enc_trigger = 7});
  ASSERT_TRUE(take_job());
  finish_job(Code::ObjectFound, true, kStartUs + 50'000);
  status();
  EXPECT_EQ(result().enc_capture, 7U);
}

TEST_F(ControllerTest, GivesNoPoseOfASensorThatLooksElsewhere) {
  for (const Code sensor :
       {Code::SensorMoved, Code::WarmingUp, Code::WrongSerial, Code::ClockFault}) {
    health_.sensor = Code::SensorHealthy;
    exchange_->health.publish(health_);
    send(PlcCommandCode::Register);
    ASSERT_TRUE(take_job());
    health_.sensor = sensor;
    exchange_->health.publish(health_);
    finish_job(Code::ObjectFound, true);
    EXPECT_FALSE(flag(kFlagResultValid));
    EXPECT_TRUE(flag(kFlagDone));
    EXPECT_EQ(result().code, sensor);
    EXPECT_TRUE(result().objects.empty());
  }
}

TEST_F(ControllerTest, TriggerRunsFromAcceptanceToLatchedResult) {
  EXPECT_EQ(send(PlcCommandCode::Register, {.part_tag = 99}), Code::Accepted);
  EXPECT_EQ(status().ack_seq, 1);
  EXPECT_EQ(status().ack_code, Code::Accepted);
  EXPECT_EQ(status().state, PlcState::Capturing);
  EXPECT_TRUE(flag(kFlagBusy));
  EXPECT_FALSE(flag(kFlagDone));
  ASSERT_TRUE(take_job());
  EXPECT_EQ(job().kind, JobKind::Register);
  EXPECT_EQ(job().command.part_tag, 99U);
  EXPECT_EQ(job().deadline_us, kStartUs + 500'000);
  exchange_->job.phase.store(JobPhase::Processing);
  EXPECT_EQ(status().state, PlcState::Processing);
  finish_job(Code::ObjectFound, true);
  const PlcStatus done = status();
  EXPECT_EQ(done.state, PlcState::Result);
  EXPECT_EQ(done.result_no, 1U);
  EXPECT_EQ(done.flags & (kFlagBusy | kFlagDone | kFlagResultValid | kFlagReady),
            kFlagDone | kFlagResultValid | kFlagReady);
  EXPECT_EQ(result().code, Code::ObjectFound);
  EXPECT_EQ(done.diagnostics.jobs_accepted, 1U);
}

TEST_F(ControllerTest, ResultStaysLatchedWhateverHappensButACommand) {
  send(PlcCommandCode::Register);
  take_job();
  finish_job(Code::BelowFitness);
  const std::uint64_t number = status().result_no;
  controller_->on_control_lost();
  clock_.advance_us(60'000'000);
  health_.sensor = Code::SensorNotConnected;
  exchange_->health.publish(health_);
  EXPECT_EQ(status().result_no, number);
  EXPECT_EQ(result().code, Code::BelowFitness);
  EXPECT_EQ(send(static_cast<PlcCommandCode>(55)),
            Code::UnknownCommand);  // refused: changes nothing
  EXPECT_EQ(status().result_no, number);
  EXPECT_EQ(send(PlcCommandCode::ClearResult), Code::Accepted);
  EXPECT_EQ(status().result_no, 0U);
  EXPECT_FALSE(flag(kFlagDone));
}

TEST_F(ControllerTest, FourPhaseStyleDropsTheTokenAndKeepsTheResult) {
  send(PlcCommandCode::Register);
  take_job();
  finish_job(Code::ObjectFound, true);
  ASSERT_TRUE(flag(kFlagDone));
  EXPECT_EQ(controller_->on_command({}), Code::Ok);
  EXPECT_EQ(status().ack_seq, 0);
  EXPECT_TRUE(flag(kFlagDone));
}

TEST_F(ControllerTest, RefusesWhatItDoesNotKnow) {
  for (const int code : {1, 12, 25, 30, 44, 55, 70, 75, 83, 65535}) {
    EXPECT_EQ(send(static_cast<PlcCommandCode>(code)), Code::UnknownCommand) << code;
  }
  EXPECT_EQ(status().error_count, 10U);
}

TEST_F(ControllerTest, RefusesASecondTriggerWhileBusyAndMarksTheOverrun) {
  send(PlcCommandCode::Register);
  EXPECT_EQ(send(PlcCommandCode::Register), Code::Busy);
  EXPECT_TRUE(flag(kFlagOverrun));
  EXPECT_EQ(status().ack_code, Code::Busy);
  EXPECT_EQ(status().diagnostics.overruns, 1U);
  take_job();
  EXPECT_EQ(job().command.seq, 1);  // the first one runs on
  finish_job(Code::RoiEmpty);
  EXPECT_EQ(send(PlcCommandCode::Register), Code::Accepted);
  EXPECT_FALSE(flag(kFlagOverrun));
}

TEST_F(ControllerTest, NeedsArming) {
  EXPECT_EQ(send(PlcCommandCode::Stop), Code::Accepted);
  EXPECT_EQ(status().state, PlcState::Stopped);
  EXPECT_EQ(status().status_code, Code::NotArmed);
  for (const auto code :
       {PlcCommandCode::Register, PlcCommandCode::Capture, PlcCommandCode::RegisterLastCapture,
        PlcCommandCode::RegisterWithRetries}) {
    EXPECT_EQ(send(code), Code::NotArmed);
  }
  EXPECT_EQ(send(PlcCommandCode::Arm), Code::Accepted);
  EXPECT_EQ(send(PlcCommandCode::Register), Code::Accepted);
}

TEST_F(ControllerTest, NamesTheRegisterOfABadParameter) {
  EXPECT_EQ(send(PlcCommandCode::Register, {.max_objects = 9}), Code::BadParameter);
  EXPECT_EQ(status().status_detail, 4);
  EXPECT_EQ(send(PlcCommandCode::Register, {.pose_format = 8}), Code::BadParameter);
  EXPECT_EQ(status().status_detail, 7);
  EXPECT_EQ(send(PlcCommandCode::Register, {.options = 0x20}), Code::BadParameter);
  EXPECT_EQ(status().status_detail, 5);
  EXPECT_EQ(send(PlcCommandCode::Register, {.model_id = 4}), Code::BadParameter);
  EXPECT_EQ(status().status_detail, 3);
  EXPECT_EQ(send(PlcCommandCode::SelectPreset), Code::BadParameter);
  EXPECT_EQ(status().status_detail, 2);
  EXPECT_EQ(send(PlcCommandCode::RegisterLastCapture), Code::BadParameter);
  EXPECT_EQ(status().status_detail, 1);
  EXPECT_EQ(send(PlcCommandCode::Register, {.options = kOptionUseLastCapture}), Code::BadParameter);
  EXPECT_EQ(status().status_detail, 5);
  EXPECT_EQ(send(PlcCommandCode::Register, {.model_id = 3}), Code::Accepted);
  EXPECT_EQ(status().status_detail, 0);
}

TEST_F(ControllerTest, AnswersBeforeTheDeadlineWhenTheJobHangs) {
  send(PlcCommandCode::Register, {.timeout_ms = 100});
  take_job();
  clock_.advance_us(94'999);
  EXPECT_TRUE(flag(kFlagBusy));
  clock_.advance_us(1);
  const PlcStatus late = status();
  EXPECT_EQ(late.flags & (kFlagBusy | kFlagDone | kFlagResultValid), kFlagDone);
  EXPECT_EQ(result().code, Code::JobDeadline);
  EXPECT_EQ(result().cmd_seq, 1);
  EXPECT_TRUE(exchange_->job.cancel_of(job().number).load());
  EXPECT_EQ(late.diagnostics.deadlines_missed, 1U);
}

TEST_F(ControllerTest, NeverPublishesAPoseThatComesPastTheDeadline) {
  send(PlcCommandCode::Register, {.timeout_ms = 100});
  take_job();
  clock_.advance_us(100'000);
  finish_job(Code::ObjectFound, true);
  EXPECT_FALSE(flag(kFlagResultValid));
  EXPECT_EQ(result().code, Code::JobDeadline);
  EXPECT_TRUE(result().objects.empty());
}

TEST_F(ControllerTest, ALateJobDoesNotHoldUpTheNextOne) {
  send(PlcCommandCode::Register, {.timeout_ms = 100});
  take_job();
  const JobRequest late = job();
  clock_.advance_us(100'000);
  ASSERT_EQ(status().state, PlcState::Result);
  EXPECT_EQ(send(PlcCommandCode::Register), Code::Accepted);
  // The late answer arrives now: it belongs to nobody.
  JobOutcome outcome;
  outcome.number = late.number;
  outcome.result.code = Code::ObjectFound;
  exchange_->job.outcome.publish(outcome);
  exchange_->job.finished.store(late.number);
  EXPECT_TRUE(flag(kFlagBusy));
  ASSERT_TRUE(take_job());
  EXPECT_FALSE(exchange_->job.cancel_of(job().number).load());
  finish_job(Code::RoiEmpty);
  EXPECT_EQ(status().state, PlcState::Result);
  EXPECT_EQ(result().code, Code::RoiEmpty);
  EXPECT_EQ(result().cmd_seq, 2);
}

TEST_F(ControllerTest, RefusesAThirdJobWhileTwoWindDown) {
  for (int i = 0; i < 2; ++i) {
    ASSERT_EQ(send(PlcCommandCode::Register, {.timeout_ms = 100}), Code::Accepted);
    clock_.advance_us(100'000);
    ASSERT_EQ(status().state, PlcState::Result);
  }
  EXPECT_EQ(send(PlcCommandCode::Register), Code::Busy);
  exchange_->job.finished.store(1);
  EXPECT_EQ(send(PlcCommandCode::Register), Code::Accepted);
}

TEST_F(ControllerTest, WarnsOfRepeatedMisses) {
  for (int i = 0; i < 3; ++i) {
    send(PlcCommandCode::Register, {.timeout_ms = 50});
    take_job();
    clock_.advance_us(50'000);
    ASSERT_EQ(status().state, PlcState::Result);
    exchange_->job.finished.store(job().number);
  }
  EXPECT_EQ(status().status_code, Code::DeadlineMissed);
  EXPECT_TRUE(flag(kFlagWarning));
  send(PlcCommandCode::Register);
  take_job();
  finish_job(Code::ObjectFound, true);
  EXPECT_EQ(status().status_code, Code::Ready);
}

TEST_F(ControllerTest, AbortAnswersAtOnce) {
  send(PlcCommandCode::Register);
  take_job();
  EXPECT_EQ(send(PlcCommandCode::Abort), Code::Accepted);
  EXPECT_EQ(status().flags & (kFlagBusy | kFlagDone), kFlagDone);
  EXPECT_EQ(result().code, Code::Aborted);
  EXPECT_EQ(result().cmd_seq, 1);
  EXPECT_TRUE(exchange_->job.cancel_of(job().number).load());
  EXPECT_EQ(status().state, PlcState::Result);
}

TEST_F(ControllerTest, StopEndsTheJobAndDisarms) {
  send(PlcCommandCode::Register);
  take_job();
  EXPECT_EQ(send(PlcCommandCode::Stop), Code::Accepted);
  EXPECT_EQ(result().code, Code::Aborted);
  EXPECT_FALSE(flag(kFlagReady));
  EXPECT_EQ(send(PlcCommandCode::Register), Code::NotArmed);
}

TEST_F(ControllerTest, LostHeartbeatInvalidatesAndNeedsArming) {
  send(PlcCommandCode::Register);
  take_job();
  finish_job(Code::ObjectFound, true);
  ASSERT_TRUE(flag(kFlagResultValid));
  controller_->on_heartbeat_lost(true);
  EXPECT_EQ(status().result_no, 0U);
  EXPECT_EQ(status().status_code, Code::HeartbeatLost);
  EXPECT_EQ(status().flags & (kFlagReady | kFlagHeartbeatLost | kFlagError),
            kFlagHeartbeatLost | kFlagError);
  EXPECT_EQ(send(PlcCommandCode::Register), Code::HeartbeatLost);
  EXPECT_EQ(send(PlcCommandCode::Arm), Code::HeartbeatLost);
  controller_->on_heartbeat_lost(false);
  EXPECT_EQ(status().status_code, Code::HeartbeatLost);
  EXPECT_EQ(send(PlcCommandCode::Register), Code::NotArmed);
  EXPECT_EQ(send(PlcCommandCode::Arm), Code::Accepted);
  EXPECT_EQ(status().status_code, Code::Ready);
}

TEST_F(ControllerTest, LostHeartbeatAbortsTheRunningJobForGood) {
  send(PlcCommandCode::Register);
  take_job();
  controller_->on_heartbeat_lost(true);
  EXPECT_TRUE(exchange_->job.cancel_of(job().number).load());
  EXPECT_FALSE(flag(kFlagBusy));
  finish_job(Code::ObjectFound, true);
  EXPECT_FALSE(flag(kFlagDone));
}

TEST_F(ControllerTest, SelectsAPresetAndAnswersWhenItIsInUse) {
  EXPECT_EQ(send(PlcCommandCode::SelectPreset, {.preset_id = 12}), Code::Accepted);
  EXPECT_TRUE(flag(kFlagBusy));
  EXPECT_EQ(send(PlcCommandCode::Register), Code::Busy);
  ASSERT_TRUE(take_wish());
  EXPECT_EQ(wish().action, ConfigAction::Select);
  EXPECT_EQ(wish().preset, 12);
  answer_wish(Code::ConfigLoaded, 12);
  EXPECT_EQ(status().active_preset, 12);
  EXPECT_EQ(status().state, PlcState::Result);
  EXPECT_EQ(result().code, Code::ConfigLoaded);
  EXPECT_EQ(status().status_code, Code::Ready);
}

TEST_F(ControllerTest, KeepsTheOldPresetAndSaysWhy) {
  send(PlcCommandCode::SelectPreset, {.preset_id = 12});
  take_wish();
  answer_wish(Code::PresetMissing, 11);
  EXPECT_EQ(status().active_preset, 11);
  EXPECT_EQ(result().code, Code::PresetMissing);
  EXPECT_EQ(status().status_code, Code::PresetMissing);
  EXPECT_TRUE(flag(kFlagWarning));
  EXPECT_TRUE(flag(kFlagReady));
  EXPECT_EQ(send(PlcCommandCode::Register), Code::Accepted);
}

TEST_F(ControllerTest, TriggerWithAnotherPresetSwitchesFirst) {
  send(PlcCommandCode::Register, {.preset_id = 12});
  EXPECT_FALSE(take_job());
  ASSERT_TRUE(take_wish());
  EXPECT_EQ(wish().preset, 12);
  clock_.advance_us(50'000);
  config_.active.timeout_ms = 300;
  answer_wish(Code::ConfigLoaded, 12);
  EXPECT_TRUE(flag(kFlagBusy));
  ASSERT_TRUE(take_job());
  EXPECT_EQ(job().deadline_us, kStartUs + 300'000);  // from acceptance, by the new preset's value
  finish_job(Code::ObjectFound, true);
  EXPECT_TRUE(flag(kFlagResultValid));
}

TEST_F(ControllerTest, TriggerWhosePresetComesTooLateIsADeadline) {
  send(PlcCommandCode::Register, {.preset_id = 12, .timeout_ms = 100});
  take_wish();
  clock_.advance_us(100'000);
  EXPECT_TRUE(flag(kFlagDone));
  EXPECT_EQ(result().code, Code::JobDeadline);
  answer_wish(Code::ConfigLoaded, 12);
  EXPECT_FALSE(take_job());
  EXPECT_EQ(status().active_preset, 12);
}

TEST_F(ControllerTest, LostSensorTakesReadyAwayAndGivesItBack) {
  health_.sensor = Code::SensorNotConnected;
  exchange_->health.publish(health_);
  EXPECT_EQ(status().status_code, Code::SensorNotConnected);
  EXPECT_EQ(status().state, PlcState::Fault);
  EXPECT_EQ(status().flags & (kFlagReady | kFlagSensorOk | kFlagError), kFlagError);
  health_.sensor = Code::SensorHealthy;
  exchange_->health.publish(health_);
  EXPECT_EQ(status().state, PlcState::Ready);
  EXPECT_TRUE(flag(kFlagReady));
}

TEST_F(ControllerTest, CrashOfTheLastRunIsAFaultUntilReset) {
  build({.auto_arm = true, .fault = Code::InternalFault});
  EXPECT_EQ(status().state, PlcState::Fault);
  EXPECT_EQ(status().status_code, Code::InternalFault);
  EXPECT_EQ(send(PlcCommandCode::Arm), Code::NotArmed);
  EXPECT_EQ(send(PlcCommandCode::ResetFault), Code::Accepted);
  EXPECT_EQ(status().state, PlcState::Stopped);
  EXPECT_EQ(send(PlcCommandCode::Arm), Code::Accepted);
  EXPECT_EQ(status().state, PlcState::Ready);
}

TEST_F(ControllerTest, WatchdogRestartIsAWarningUntilReset) {
  build({.auto_arm = true, .watchdog_restart = true});
  EXPECT_EQ(status().status_code, Code::WatchdogRestart);
  EXPECT_TRUE(flag(kFlagReady));
  EXPECT_TRUE(flag(kFlagWarning));
  send(PlcCommandCode::ResetFault);
  EXPECT_EQ(status().status_code, Code::Ready);
}

TEST_F(ControllerTest, MissingRealTimeRightsAreAWarning) {
  health_.realtime_missing = true;
  exchange_->health.publish(health_);
  EXPECT_EQ(status().status_code, Code::MemoryNotLocked);
  EXPECT_TRUE(flag(kFlagWarning));
  EXPECT_TRUE(flag(kFlagReady));
}

TEST_F(ControllerTest, RecordedDataIsMarked) {
  EXPECT_FALSE(flag(kFlagReplay));
  health_.live = false;
  exchange_->health.publish(health_);
  EXPECT_TRUE(flag(kFlagReplay));
}

TEST_F(ControllerTest, RetriesOnlyWhereAskedFor) {
  send(PlcCommandCode::Register);
  take_job();
  EXPECT_FALSE(job().with_retries);
  finish_job(Code::RoiEmpty);
  send(PlcCommandCode::RegisterWithRetries);
  take_job();
  EXPECT_TRUE(job().with_retries);
  finish_job(Code::RoiEmpty);
  send(PlcCommandCode::RegisterWithRetries, {.options = kOptionNoRetry});
  take_job();
  EXPECT_FALSE(job().with_retries);
  finish_job(Code::RoiEmpty);
  send(PlcCommandCode::RegisterLastCapture);
  take_job();
  EXPECT_TRUE(job().last_capture);
}

TEST_F(ControllerTest, ClearsCountersOnCommandEvenWhileBusy) {
  send(PlcCommandCode::Register);
  send(PlcCommandCode::Register);
  ASSERT_EQ(status().diagnostics.overruns, 1U);
  EXPECT_EQ(send(PlcCommandCode::ClearCounters), Code::Accepted);
  EXPECT_EQ(status().diagnostics.overruns, 0U);
  EXPECT_EQ(status().error_count, 0);
  EXPECT_TRUE(flag(kFlagBusy));
}

TEST_F(ControllerTest, RecordingIsAnsweredByTheRecorderAndDoesNotHoldUpJobs) {
  PlcCommand command;
  command.part_tag = 5;
  ASSERT_EQ(send(PlcCommandCode::RecordBegin, command), Code::Accepted);
  EXPECT_TRUE(flag(kFlagBusy));
  ASSERT_TRUE(exchange_->record.request.update());
  const RecordRequest& wish = exchange_->record.request.get();
  EXPECT_EQ(wish.action, RecordAction::Begin);
  EXPECT_EQ(wish.part_tag, 5U);
  RecordState record;
  record.answered = wish.number;
  record.answer = Code::CaptureDone;
  record.phase = PlcRecording::Running;
  exchange_->record.state.publish(record);
  EXPECT_TRUE(flag(kFlagDone));
  EXPECT_EQ(result().code, Code::CaptureDone);
  EXPECT_EQ(result().part_tag, 5U);
  EXPECT_EQ(status().recording, PlcRecording::Running);
  EXPECT_EQ(send(PlcCommandCode::Register), Code::Accepted);
}

TEST_F(ControllerTest, ARecorderThatWaitsForItsDiskIsBusyAfterTwoSecondsAndTakesNoOtherWish) {
  ASSERT_EQ(send(PlcCommandCode::RecordBegin), Code::Accepted);
  clock_.advance_us(2'000'000);
  EXPECT_TRUE(flag(kFlagDone));
  EXPECT_EQ(result().code, Code::Busy);
  EXPECT_EQ(send(PlcCommandCode::RecordEnd), Code::Busy);
  EXPECT_EQ(send(PlcCommandCode::Register), Code::Accepted) << "jobs go on";
}

TEST_F(ControllerTest, ADiskThatTakesNoFramesIsAWarning) {
  RecordState record;
  record.phase = PlcRecording::Running;
  record.failing = true;
  record.dropped = 12;
  exchange_->record.state.publish(record);
  EXPECT_TRUE(flag(kFlagWarning));
  EXPECT_EQ(status().status_code, Code::DiskFull);
  EXPECT_EQ(status().diagnostics.record_dropped, 12U);
  EXPECT_TRUE(flag(kFlagReady)) << "registration goes on";
}

}  // namespace
}  // namespace grapnel
