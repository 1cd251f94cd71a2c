#include "firmware_app/job_executor.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <thread>

#include "base/math.h"
#include "base/running_stage.h"
#include "firmware_app/controller.h"
#include "firmware_app/realtime.h"
#include "tests/firmware_app/fakes.h"

namespace grapnel {
namespace {

constexpr int kWidth = 32;
constexpr int kHeight = 24;
constexpr std::int64_t kNowUs = 10'000'000;

/// The registration thread's work, with frames published by the test and a clock turned by it.
class JobExecutorTest : public ::testing::Test {
 protected:
  JobExecutorTest() {
    capture_.exposure_us = 30'000;
    capture_.frame_wait_ms = 30;
    const std::size_t bytes = 64 * kWidth * kHeight * sizeof(std::uint16_t);
    memory_ = std::make_unique<MemoryBlock>(bytes);
    Arena arena(memory_->span());
    background_.reserve(arena, kWidth, kHeight, 3);
    evidence_.reserve(arena, kWidth, kHeight, false);
    auto runner = std::make_unique<test::FakeRunner>();
    runner_ = runner.get();
    runner_->answer = [this](const DepthFrame&, const JobContext&) { return accepted(); };
    preset_.runner = std::move(runner);
    preset_.profile.preset.number = 11;
    preset_.profile.preset.rev = 99;
    preset_.profile.pose_format = 2;
    preset_.profile.retries = 2;
    preset_.profile.max_occupied_share = 0.01;
    ModelProfile model;
    model.id = 5;
    model.grasp_id = 1;
    model.model_from_grasp.translation() = Vec3d(0.0, 0.0, 0.1);
    preset_.profile.models.push_back(model);
    make_executor();
    request_.number = 1;
    request_.command.seq = 7;
    request_.command.accepted_us = kNowUs;
    request_.deadline_us = kNowUs + 500'000;
  }

  void make_executor() {
    executor_ =
        std::make_unique<JobExecutor>(ExecutorParts{clock(), &pool_, &camera_, &background_,
                                                    &exchange_, &progress_, &stage_, &evidence_},
                                      capture_, 3);
    executor_->use(&preset_);
  }
  virtual const Clock* clock() { return &clock_; }

  /// A frame whose middle of exposure lies `after_us` after the trigger.
  void publish(std::int64_t after_us, std::uint64_t sequence, std::uint16_t depth = 1000,
               std::uint32_t lost_packets = 0) {
    FramePool::Slot* slot = pool_.begin_write();
    ASSERT_NE(slot, nullptr);
    std::fill(slot->depth, slot->depth + kWidth * kHeight, depth);
    slot->frame.depth = {slot->depth, kWidth, kHeight};
    slot->frame.intrinsics = {kWidth, kHeight, 30.0, 30.0, 15.5, 11.5};
    slot->frame.exposure_us = kNowUs + after_us;
    slot->frame.sequence = sequence;
    slot->frame.lost_packets = lost_packets;
    pool_.publish(slot);
  }
  static RegistrationReports accepted() {
    RegistrationReports reports;
    RegistrationReport report;
    report.accepted = true;
    report.code = Code::ObjectFound;
    report.target_from_source.translation() = Vec3d(0.1, 0.2, 1.0);
    report.has_pose = true;
    report.fitness = 0.9;
    report.coverage = 0.4;
    report.quality = 0.8126;
    reports.objects.push_back(report);
    reports.code = Code::ObjectFound;
    reports.found = 2;
    reports.seed = 1234;
    reports.stage_us[static_cast<std::size_t>(Stage::Refine)] = 777;
    return reports;
  }
  const PlcResult& run() {
    executor_->execute(request_, outcome_);
    return outcome_.result;
  }

  ManualClock clock_{kNowUs};
  FramePool pool_{6, kWidth, kHeight, false};
  test::StatusCamera camera_;
  Background background_;
  EvidenceSlot evidence_;
  std::unique_ptr<MemoryBlock> memory_;
  JobExchange exchange_;
  std::atomic<std::uint64_t> progress_{0};
  std::atomic<Stage> stage_{Stage::None};
  CaptureSettings capture_;
  ActivePreset preset_;
  test::FakeRunner* runner_ = nullptr;
  std::unique_ptr<JobExecutor> executor_;
  JobRequest request_;
  JobOutcome outcome_;
};

TEST_F(JobExecutorTest, UsesTheFirstFrameWhoseExposureStartsAfterTheTrigger) {
  publish(-20'000, 1);
  publish(14'999, 2);  // its exposure of 30 ms began 1 us before the trigger
  publish(15'000, 3);  // begins with it
  publish(48'000, 4);
  EXPECT_EQ(run().frame_id, 3U);
  EXPECT_EQ(run().capture_delay_us, 15'000U);
}

TEST_F(JobExecutorTest, UsesTheNearestFrameWhereConfigured) {
  capture_.frame_choice = FrameChoice::Nearest;
  make_executor();
  publish(-4'000, 1);
  publish(29'000, 2);
  EXPECT_EQ(run().frame_id, 1U);
}

TEST_F(JobExecutorTest, AnswersWithGraspPoseAndTheCommandsOwnNumbers) {
  publish(20'000, 3);
  request_.command.part_tag = 42;
  request_.command.enc_trigger = 1000;
  clock_.advance_us(60'000);
  const PlcResult& result = run();
  EXPECT_EQ(result.code, Code::ObjectFound);
  EXPECT_EQ(result.cmd_seq, 7);
  EXPECT_EQ(result.part_tag, 42U);
  EXPECT_EQ(result.enc_capture, 1000U);
  EXPECT_EQ(result.found, 2);
  EXPECT_EQ(result.seed, 1234U);
  EXPECT_EQ(result.preset, 11);
  EXPECT_EQ(result.preset_rev, 99);
  EXPECT_EQ(result.pose_format, 2);
  EXPECT_EQ(result.age_us, 40'000U);
  ASSERT_EQ(result.objects.size(), 1U);
  const PlcObject& object = result.objects[0];
  EXPECT_TRUE(object.accepted);
  EXPECT_EQ(object.model_id, 5);
  EXPECT_EQ(object.pick_point_id, 1);
  EXPECT_EQ(object.frame, PoseFrame::Camera);
  EXPECT_EQ(object.quality_score, 813);
  EXPECT_TRUE(object.frame_from_grasp.translation().isApprox(Vec3d(0.1, 0.2, 1.1), 1e-12));
  EXPECT_EQ(outcome_.stage_us[static_cast<std::size_t>(Stage::Refine) - 1], 777U);
}

TEST_F(JobExecutorTest, GivesTheGraspInTheRobotsFrameWhenCalibrated) {
  publish(20'000, 3);
  preset_.profile.calibrated = true;
  // A quarter turn about z and a metre along x: (x, y, z) → (1 - y, x, z).
  preset_.profile.robot_from_camera.linear() =
      rotation_from_vector(Vec3d(0.0, 0.0, math::kPi / 2.0));
  preset_.profile.robot_from_camera.translation() = Vec3d(1.0, 0.0, 0.0);
  const PlcObject robot = run().objects[0];
  EXPECT_EQ(robot.frame, PoseFrame::RobotBase);
  EXPECT_TRUE(robot.frame_from_grasp.translation().isApprox(Vec3d(0.8, 0.1, 1.1), 1e-12));
  request_.command.options = kOptionCameraFrame;
  const PlcObject camera = run().objects[0];
  EXPECT_EQ(camera.frame, PoseFrame::Camera);
  EXPECT_TRUE(camera.frame_from_grasp.translation().isApprox(Vec3d(0.1, 0.2, 1.1), 1e-12));
  request_.command.options = 0;
  exchange_.foreign_sensor = true;
  EXPECT_EQ(run().objects[0].frame, PoseFrame::Camera);
}

TEST_F(JobExecutorTest, CarriesEveryReasonOfARejection) {
  publish(20'000, 3);
  runner_->answer = [](const DepthFrame&, const JobContext&) {
    RegistrationReports reports;
    RegistrationReport report;
    report.code = Code::BelowFitness;
    report.reasons.push_back({Check::MatchedShare, 0.4, 0.7});
    report.reasons.push_back({Check::SeenThrough, 0.3, 0.1});
    reports.objects.push_back(report);
    reports.code = Code::BelowFitness;
    return reports;
  };
  const PlcResult& result = run();
  EXPECT_EQ(result.code, Code::BelowFitness);
  EXPECT_FALSE(result.objects[0].accepted);
  EXPECT_EQ(result.objects[0].reasons, (1U << 9) | (1U << 11));
}

TEST_F(JobExecutorTest, PassesTheContextOn) {
  publish(20'000, 3);
  preset_.profile.models.push_back({.id = 6, .grasp_id = 0});
  request_.command.model_id = 6;
  request_.command.max_objects = 3;
  runner_->answer = [this](const DepthFrame&, const JobContext& context) {
    EXPECT_EQ(context.model_mask, 2U);
    EXPECT_EQ(context.max_objects, 3);
    EXPECT_LT(context.deadline_us, request_.deadline_us);
    EXPECT_EQ(context.abort, &exchange_.cancel[1]);
    return accepted();
  };
  EXPECT_EQ(run().code, Code::ObjectFound);
}

TEST_F(JobExecutorTest, NeverAnswersWithAPosePastTheDeadline) {
  publish(20'000, 3);
  runner_->answer = [this](const DepthFrame&, const JobContext&) {
    clock_.advance_us(500'000);
    return accepted();
  };
  EXPECT_EQ(run().code, Code::JobDeadline);
  EXPECT_TRUE(outcome_.result.objects.empty());
}

TEST_F(JobExecutorTest, HandsThePipelinesErrorOn) {
  publish(20'000, 3);
  runner_->answer = [](const DepthFrame&, const JobContext&) -> Result<RegistrationReports> {
    return Error{Code::TooFewPoints, Stage::Segment};
  };
  EXPECT_EQ(run().code, Code::TooFewPoints);
  EXPECT_TRUE(outcome_.result.objects.empty());
}

TEST_F(JobExecutorTest, RefusesFramesThatAreNoUse) {
  publish(20'000, 3, 0);
  EXPECT_EQ(run().code, Code::DepthMostlyInvalid);
  publish(60'000, 4, 1000, 51);
  request_.command.accepted_us = kNowUs + 30'000;
  EXPECT_EQ(run().code, Code::LostPackets);
  EXPECT_EQ(runner_->runs, 0);
}

TEST_F(JobExecutorTest, MarksLostPacketsInTheAnswer) {
  publish(20'000, 3, 1000, 2);
  EXPECT_EQ(run().objects[0].quality_bits & kQualityLostPackets, kQualityLostPackets);
}

TEST_F(JobExecutorTest, AnswersALostSensorAtOnce) {
  camera_.set(CameraState::Lost, Code::SensorNotConnected);
  EXPECT_EQ(run().code, Code::SensorNotConnected);
  camera_.set(CameraState::Ended, Code::SensorHealthy);
  EXPECT_EQ(run().code, Code::NoFrameInTime);
  EXPECT_FALSE(outcome_.has_frame);
}

TEST_F(JobExecutorTest, AnswersAnAbortWhileWaiting) {
  exchange_.cancel_of(1) = true;
  EXPECT_EQ(run().code, Code::Aborted);
}

TEST_F(JobExecutorTest, NeedsAPreset) {
  publish(20'000, 3);
  executor_->use(nullptr);
  EXPECT_EQ(run().code, Code::PresetMissing);
}

TEST_F(JobExecutorTest, RetriesOnFurtherFramesUntilOneIsAccepted) {
  publish(20'000, 3);
  publish(53'000, 4);
  publish(86'000, 5);
  runner_->answer = [](const DepthFrame& frame, const JobContext&) -> Result<RegistrationReports> {
    if (frame.sequence < 5) return Error{Code::NoConsensus, Stage::Coarse};
    return accepted();
  };
  request_.with_retries = true;
  const PlcResult& result = run();
  EXPECT_EQ(result.code, Code::ObjectFound);
  EXPECT_EQ(result.retries, 2);
  EXPECT_EQ(result.frame_id, 5U);
  EXPECT_EQ(result.objects[0].quality_bits & kQualityRetried, kQualityRetried);
  EXPECT_EQ(runner_->runs, 3);
}

TEST_F(JobExecutorTest, RetriesNoFurtherThanASurfaceGrasp) {
  publish(20'000, 3);
  publish(53'000, 4, 0);  // would answer that depth is invalid
  runner_->answer = [](const DepthFrame&, const JobContext&) {
    RegistrationReports reports = accepted();
    reports.code = Code::SurfaceGrasp;
    return reports;
  };
  request_.with_retries = true;
  EXPECT_EQ(run().code, Code::SurfaceGrasp);
  EXPECT_EQ(outcome_.result.objects.size(), 1U);
}

TEST_F(JobExecutorTest, KeepsEvidenceOfARejectionButNotOfAnEmptyBelt) {
  const std::pair<Code, bool> cases[] = {{Code::NoConsensus, true},
                                         {Code::RoiEmpty, false},
                                         {Code::SurfaceGrasp, false},
                                         {Code::ObjectFound, false}};
  for (const auto& [code, kept] : cases) {
    publish(20'000, 3);
    runner_->answer = [code = code](const DepthFrame&, const JobContext&) {
      RegistrationReports reports;
      reports.code = code;
      return reports;
    };
    run();
    executor_->hand_over(request_);
    EXPECT_EQ(evidence_.peek() != nullptr, kept) << static_cast<int>(code);
    evidence_.release();
  }
}

TEST_F(JobExecutorTest, ALossyLastFrameLeavesNoEvidenceOfTheFrameBefore) {
  publish(20'000, 3);
  publish(53'000, 4, 1000, 51);
  runner_->answer = [](const DepthFrame&, const JobContext&) -> Result<RegistrationReports> {
    return Error{Code::NoConsensus, Stage::Coarse};
  };
  preset_.profile.retries = 1;
  request_.with_retries = true;
  EXPECT_EQ(run().code, Code::LostPackets);
  executor_->hand_over(request_);
  EXPECT_EQ(evidence_.peek(), nullptr);
  request_.kind = JobKind::SaveSnapshot;
  EXPECT_EQ(run().code, Code::BadParameter);
}

TEST_F(JobExecutorTest, ASnapshotThatWaitsForTheDiskIsBusyNotLate) {
  publish(20'000, 3);
  run();
  executor_->hand_over(request_);
  JobEvidence other;
  ASSERT_TRUE(evidence_.put(other));  // the disk is still at an earlier one
  clock_.advance_us(request_.deadline_us - 2 * Controller::kAnswerMarginUs - clock_.now_us());
  request_.kind = JobKind::SaveSnapshot;
  EXPECT_EQ(run().code, Code::Busy);
}

TEST_F(JobExecutorTest, CaptureKeepsTheFrameForALaterRegistration) {
  publish(20'000, 3);
  request_.kind = JobKind::Capture;
  EXPECT_EQ(run().code, Code::CaptureDone);
  EXPECT_EQ(runner_->runs, 0);
  for (std::uint64_t sequence = 4; sequence < 12; ++sequence) publish(99'000, sequence);
  request_.kind = JobKind::Register;
  request_.last_capture = true;
  EXPECT_EQ(run().code, Code::ObjectFound);
  EXPECT_EQ(outcome_.result.frame_id, 3U);
  EXPECT_EQ(run().frame_id, 3U);  // and again
}

TEST_F(JobExecutorTest, SelfTestWantsFrameAndPreset) {
  publish(20'000, 3);
  request_.kind = JobKind::SelfTest;
  EXPECT_EQ(run().code, Code::Ready);
  executor_->use(nullptr);
  EXPECT_EQ(run().code, Code::PresetMissing);
}

TEST_F(JobExecutorTest, NotesTheStageThatRuns) {
  publish(20'000, 1);
  Stage before = Stage::None;
  Stage during = Stage::None;
  runner_->answer = [&](const DepthFrame&, const JobContext&) {
    before = stage_.load();
    note_stage(Stage::Coarse);
    during = stage_.load();
    return accepted();
  };
  run();
  EXPECT_EQ(before, Stage::Capture);
  EXPECT_EQ(during, Stage::Coarse);
  EXPECT_EQ(stage_.load(), Stage::None);
}

TEST_F(JobExecutorTest, AsksASteppedCameraForOneFrameAJob) {
  camera_.on_request = [this](int requests) {
    EXPECT_GE(clock_.now_us(), request_.command.accepted_us + capture_.exposure_us / 2);
    publish(clock_.now_us() - kNowUs, static_cast<std::uint64_t>(requests));
  };
  clock_.advance_us(capture_.exposure_us / 2);
  EXPECT_EQ(run().frame_id, 1U);
  request_.command.accepted_us = clock_.now_us();
  clock_.advance_us(capture_.exposure_us / 2);
  EXPECT_EQ(run().frame_id, 2U);
  EXPECT_EQ(camera_.requests(), 2);
}

TEST_F(JobExecutorTest, TellsWhetherTheRegionIsEmpty) {
  publish(20'000, 3);
  request_.kind = JobKind::CheckEmpty;
  runner_->occupied = 0.01;
  EXPECT_EQ(run().code, Code::RoiConfirmedEmpty);
  runner_->occupied = 0.011;
  EXPECT_EQ(run().code, Code::UnexplainedForeground);
}

TEST_F(JobExecutorTest, LearnsTheBeltAndUsesIt) {
  publish(20'000, 3, 1000);
  publish(53'000, 4, 1010);
  publish(86'000, 5, 1003);
  request_.kind = JobKind::LearnBackground;
  EXPECT_EQ(run().code, Code::CaptureDone);
  request_.kind = JobKind::Register;
  runner_->answer = [](const DepthFrame&, const JobContext& context) {
    EXPECT_EQ(context.background.depth.at(3, 2), 1003);  // the median
    EXPECT_TRUE(context.background.has_plane);
    return accepted();
  };
  EXPECT_EQ(run().code, Code::ObjectFound);
}

/// The same on the machine's own clock, where the test is about waiting.
class JobExecutorWaitTest : public JobExecutorTest {
 protected:
  JobExecutorWaitTest() {
    make_executor();
    const std::int64_t now_us = real_.now_us();
    offset_us_ = now_us - kNowUs;
    request_.command.accepted_us = now_us;
    request_.deadline_us = now_us + 5'000'000;
  }
  const Clock* clock() override { return &real_; }

  MonotonicClock real_;
  std::int64_t offset_us_ = 0;
};

TEST_F(JobExecutorWaitTest, GivesUpOnAFrameThatDoesNotCome) {
  EXPECT_EQ(run().code, Code::NoFrameInTime);
  EXPECT_LT(real_.now_us(), request_.deadline_us);
}

TEST_F(JobExecutorWaitTest, DeadlineBeatsTheWait) {
  capture_.frame_wait_ms = 10'000;
  make_executor();
  request_.deadline_us = real_.now_us() + 20'000;
  EXPECT_EQ(run().code, Code::JobDeadline);
  // One look at the signal (20 ms) late at the most, and a loaded machine.
  EXPECT_LT(real_.now_us(), request_.deadline_us + 1'000'000);
}

TEST_F(JobExecutorWaitTest, WakesForTheFrameItWaitsFor) {
  capture_.frame_wait_ms = 10'000;
  make_executor();
  std::thread camera([this] { publish(offset_us_ + 20'000, 9); });
  EXPECT_EQ(run().frame_id, 9U);
  camera.join();
}

}  // namespace
}  // namespace grapnel
