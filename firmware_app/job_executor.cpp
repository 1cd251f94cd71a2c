#include "firmware_app/job_executor.h"

#include <algorithm>

#include "base/running_stage.h"
#include "firmware_app/controller.h"
#include "firmware_app/plc_object.h"

namespace grapnel {
namespace {

// A waiting job looks this often whether it was cancelled or the camera went away.
constexpr std::int64_t kLookUs = 20'000;
constexpr std::int64_t kSaveLookUs = 2'000;

std::uint32_t clamp_us(std::int64_t us) noexcept {
  return static_cast<std::uint32_t>(std::clamp<std::int64_t>(us, 0, 0xffffffffLL));
}

}  // namespace

JobExecutor::JobExecutor(const ExecutorParts& parts, const CaptureSettings& capture,
                         int learn_frames)
    : parts_(parts),
      clock_(*parts.clock, *parts.progress),
      capture_(capture),
      learn_frames_(learn_frames) {}

void JobExecutor::execute(const JobRequest& request, JobOutcome& outcome) noexcept {
  outcome.number = request.number;
  outcome.has_frame = false;
  outcome.stage_us = {};
  outcome.result = {};
  PlcResult& result = outcome.result;
  result.cmd_seq = request.command.seq;
  result.part_tag = request.command.part_tag;
  result.enc_capture = request.command.enc_trigger;
  if (preset_ != nullptr) {
    result.preset = preset_->profile.preset.number;
    result.preset_rev = preset_->profile.preset.rev;
    result.pose_format = request.command.pose_format != 0 ? request.command.pose_format
                                                          : preset_->profile.pose_format;
  }
  parts_.exchange->phase.store(JobPhase::Capturing, std::memory_order_release);
  if (request.kind != JobKind::SaveSnapshot) has_evidence_ = false;
  note_stages_in(parts_.stage);
  note_stage(Stage::Capture);
  switch (request.kind) {
    case JobKind::Register:
      run_register(request, outcome);
      break;
    case JobKind::Capture:
    case JobKind::SelfTest:
      run_capture(request, outcome);
      break;
    case JobKind::LearnBackground:
      run_learn(request, outcome);
      break;
    case JobKind::CheckEmpty:
      run_check_empty(request, outcome);
      break;
    case JobKind::SaveSnapshot:
      run_save(request, outcome);
      break;
  }
  const std::int64_t now_us = clock_.now_us();
  if (now_us >= request.deadline_us && result.code != Code::Aborted) {
    result.objects.clear();
    result.code = Code::JobDeadline;
  }
  if (outcome.has_frame) {
    result.age_us = clamp_us(now_us - mid_exposure_us_);
    result.total_us = clamp_us(now_us - frame_at_us_);
  }
  if (request.kind == JobKind::Register) evidence_.result = result;
  note_stage(Stage::None);
  parts_.exchange->phase.store(JobPhase::Idle, std::memory_order_release);
}

void JobExecutor::request_frame(std::int64_t not_before_us) noexcept {
  if (!parts_.camera->stepped()) return;
  // The frame is stamped when it is handed out.
  clock_.sleep_until_us(not_before_us);
  parts_.camera->request_frame();
}

std::int64_t JobExecutor::first_exposure_us(const JobRequest& request) const noexcept {
  // Stamps are at mid-exposure; an exposure that starts after the trigger has its middle this much
  // later.
  const std::int64_t half_us =
      capture_.frame_choice == FrameChoice::FirstAfter ? std::int64_t{capture_.exposure_us} / 2 : 0;
  return request.command.accepted_us + half_us;
}

Result<FrameLease> JobExecutor::await_frame(const JobRequest& request,
                                            std::int64_t not_before_us) noexcept {
  const std::atomic<bool>& cancelled = parts_.exchange->cancel_of(request.number);
  if (request.last_capture) {
    if (!last_capture_.valid()) return Error{Code::NoFrameInTime, Stage::Capture};
    return std::move(last_capture_);
  }
  request_frame(not_before_us);
  // A stepped camera owes its frame however slow the machine is: runs must not differ by that.
  const std::int64_t give_up_us =
      parts_.camera->stepped()
          ? request.deadline_us
          : std::max(clock_.now_us(), not_before_us) + std::int64_t{capture_.frame_wait_ms} * 1000;
  for (;;) {
    const std::uint32_t seen = parts_.pool->published_signal().version();
    FrameLease lease = parts_.pool->lease_first_since(not_before_us);
    if (lease.valid()) {
      if (capture_.frame_choice == FrameChoice::Nearest) {
        lease = parts_.pool->lease_nearest(not_before_us);
      }
      return lease;
    }
    if (cancelled.load(std::memory_order_acquire)) return Error{Code::Aborted, Stage::Capture};
    const CameraStatus camera = parts_.camera->status();
    if (camera.state != CameraState::Streaming) {
      const bool ended = camera.code == Code::SensorHealthy;
      return Error{ended ? Code::NoFrameInTime : camera.code, Stage::Capture};
    }
    const std::int64_t now_us = clock_.now_us();
    if (now_us >= request.deadline_us) return Error{Code::JobDeadline, Stage::Capture};
    if (now_us >= give_up_us) return Error{Code::NoFrameInTime, Stage::Capture};
    parts_.pool->published_signal().wait(
        seen, std::min({kLookUs, request.deadline_us - now_us, give_up_us - now_us}));
  }
}

Code JobExecutor::judge_frame(const DepthFrame& frame) const noexcept {
  if (frame.lost_packets > static_cast<std::uint32_t>(capture_.max_lost_packets)) {
    return Code::LostPackets;
  }
  if (capture_.need_color && frame.color.empty()) return Code::ColorMissing;
  return valid_share(frame) < capture_.min_valid_share ? Code::DepthMostlyInvalid : Code::Ok;
}

void JobExecutor::note_frame(const JobRequest& request, const DepthFrame& frame,
                             JobOutcome& outcome) noexcept {
  frame_at_us_ = clock_.now_us();
  mid_exposure_us_ = frame.exposure_us;
  outcome.has_frame = true;
  outcome.exposure_us = frame.exposure_us;
  outcome.stage_us[0] = clamp_us(frame_at_us_ - request.command.accepted_us);
  outcome.result.frame_id = static_cast<std::uint32_t>(frame.sequence);
  outcome.result.capture_delay_us = clamp_us(frame.exposure_us - request.command.accepted_us);
  parts_.exchange->phase.store(JobPhase::Processing, std::memory_order_release);
}

JobContext JobExecutor::context_of(const JobRequest& request, const DepthFrame& frame) noexcept {
  JobContext context;
  context.background = parts_.background->view(frame);
  context.max_objects = request.command.max_objects;
  context.clock = &clock_;
  context.deadline_us = request.deadline_us - Controller::kAnswerMarginUs;
  context.abort = &parts_.exchange->cancel_of(request.number);
  if (request.command.model_id != 0) {
    context.model_mask = 0;
    const auto& models = preset_->profile.models;
    for (std::size_t i = 0; i < models.size(); ++i) {
      if (models[i].id == request.command.model_id) context.model_mask |= 1U << i;
    }
  }
  return context;
}

Code JobExecutor::attempt(const JobRequest& request, const FrameLease& lease,
                          std::uint16_t extra_quality, JobOutcome& outcome) noexcept {
  const DepthFrame& frame = lease.frame();
  PlcResult& result = outcome.result;
  result.objects.clear();
  result.found = 0;
  has_evidence_ = false;  // of an earlier frame, whose lease ends with this one's
  const Code bad_frame = judge_frame(frame);
  if (bad_frame != Code::Ok) return bad_frame;
  const JobContext context = context_of(request, frame);
  const Result<RegistrationReports> answer = preset_->runner->run(frame, context);
  remember(request, frame, context, answer);
  if (!answer) return answer.error().code;
  const RegistrationReports& reports = answer.value();
  const bool camera_frame = (request.command.options & kOptionCameraFrame) != 0 ||
                            parts_.exchange->foreign_sensor.load(std::memory_order_relaxed);
  for (const RegistrationReport& report : reports.objects) {
    result.objects.push_back(to_plc_object(report, preset_->profile, camera_frame, extra_quality));
  }
  result.found = static_cast<std::uint16_t>(std::min<std::uint32_t>(reports.found, 0xffff));
  result.seed = reports.seed;
  for (std::size_t i = 1; i < outcome.stage_us.size(); ++i) {
    const std::size_t stage = i + static_cast<std::size_t>(Stage::Capture);
    if (stage < reports.stage_us.size()) outcome.stage_us[i] = reports.stage_us[stage];
  }
  return reports.code;
}

void JobExecutor::remember(const JobRequest& request, const DepthFrame& frame,
                           const JobContext& context,
                           const Result<RegistrationReports>& answer) noexcept {
  // What ended early by time or by hand can't be repeated.
  has_evidence_ =
      answer || (answer.error().code != Code::JobDeadline && answer.error().code != Code::Aborted);
  if (!has_evidence_) return;
  evidence_.job = request.number;
  evidence_.origin = preset_->origin;
  evidence_.command = request.command;
  evidence_.label = GraspLabel::None;
  evidence_.frame = frame;
  evidence_.context = context;
  evidence_.reported = static_cast<bool>(answer);
  if (answer) {
    evidence_.reports = answer.value();
  } else {
    evidence_.code = answer.error().code;
    evidence_.stage = answer.error().stage;
  }
}

void JobExecutor::hand_over(const JobRequest& request) noexcept {
  if (!has_evidence_ || parts_.evidence == nullptr || request.kind != JobKind::Register) return;
  const std::uint16_t options = request.command.options;
  const Code code = evidence_.result.code;
  const bool rejected =
      code != Code::ObjectFound && code != Code::SurfaceGrasp && code != Code::RoiEmpty;
  const bool on_reject = parts_.snapshot_on_reject || (options & kOptionSnapshotOnReject) != 0;
  if ((options & kOptionSnapshotAlways) != 0 || (rejected && on_reject)) {
    parts_.evidence->put(evidence_);
  }
}

void JobExecutor::run_save(const JobRequest& request, JobOutcome& outcome) noexcept {
  outcome.result.code = Code::BadParameter;
  if (!has_evidence_ || parts_.evidence == nullptr) return;
  const auto command = static_cast<PlcCommandCode>(request.command.code);
  if (command == PlcCommandCode::GraspGood) evidence_.label = GraspLabel::Good;
  if (command == PlcCommandCode::GraspBad) evidence_.label = GraspLabel::Bad;
  // The one before may still be under way to the disk. Gives up before the field bus would answer
  // that the job is late.
  const std::int64_t give_up_us = request.deadline_us - 2 * Controller::kAnswerMarginUs;
  while (!parts_.evidence->put(evidence_)) {
    const std::int64_t now_us = clock_.now_us();
    if (now_us >= give_up_us ||
        parts_.exchange->cancel_of(request.number).load(std::memory_order_acquire)) {
      outcome.result.code = Code::Busy;
      return;
    }
    clock_.sleep_until_us(now_us + kSaveLookUs);
  }
  outcome.result.code = Code::CaptureDone;
}

void JobExecutor::run_register(const JobRequest& request, JobOutcome& outcome) noexcept {
  PlcResult& result = outcome.result;
  if (preset_ == nullptr) {
    result.code = Code::PresetMissing;
    return;
  }
  const std::uint16_t attempts = request.with_retries
                                     ? static_cast<std::uint16_t>(1 + preset_->profile.retries)
                                     : std::uint16_t{1};
  std::int64_t not_before_us = first_exposure_us(request);
  for (std::uint16_t i = 0; i < attempts; ++i) {
    Result<FrameLease> lease = await_frame(request, not_before_us);
    if (!lease) {
      if (i == 0 || lease.error().code == Code::Aborted) result.code = lease.error().code;
      return;
    }
    const DepthFrame& frame = lease.value().frame();
    note_frame(request, frame, outcome);
    unsigned quality = i > 0 ? kQualityRetried : 0U;
    if (frame.lost_packets > 0) quality |= kQualityLostPackets;
    result.retries = i;
    result.code = attempt(request, lease.value(), static_cast<std::uint16_t>(quality), outcome);
    not_before_us = frame.exposure_us + 1;
    keep(std::move(lease.value()));
    const bool final = result.code == Code::ObjectFound || result.code == Code::SurfaceGrasp ||
                       result.code == Code::Aborted || result.code == Code::JobDeadline;
    if (final || request.last_capture || clock_.now_us() >= request.deadline_us) return;
  }
}

void JobExecutor::run_capture(const JobRequest& request, JobOutcome& outcome) noexcept {
  Result<FrameLease> lease = await_frame(request, first_exposure_us(request));
  if (!lease) {
    outcome.result.code = lease.error().code;
    return;
  }
  note_frame(request, lease.value().frame(), outcome);
  const Code bad_frame = judge_frame(lease.value().frame());
  keep(std::move(lease.value()));
  const bool testing = request.kind == JobKind::SelfTest;
  outcome.result.code = testing ? Code::Ready : Code::CaptureDone;
  if (testing && preset_ == nullptr) outcome.result.code = Code::PresetMissing;
  if (bad_frame != Code::Ok) outcome.result.code = bad_frame;
}

void JobExecutor::run_learn(const JobRequest& request, JobOutcome& outcome) noexcept {
  outcome.result.code = Code::Busy;
  if (!parts_.background->begin()) return;
  std::int64_t not_before_us = first_exposure_us(request);
  for (int i = 0; i < learn_frames_; ++i) {
    const Result<FrameLease> lease = await_frame(request, not_before_us);
    outcome.result.code = lease ? Code::Ok : lease.error().code;
    if (!lease) return;
    const DepthFrame& frame = lease.value().frame();
    note_frame(request, frame, outcome);
    not_before_us = frame.exposure_us + 1;
    const Status added = parts_.background->add(frame);
    if (!added) {
      outcome.result.code = added.error().code;
      return;
    }
  }
  const Status learned = parts_.background->finish();
  outcome.result.code = learned ? Code::CaptureDone : learned.error().code;
}

void JobExecutor::run_check_empty(const JobRequest& request, JobOutcome& outcome) noexcept {
  PlcResult& result = outcome.result;
  result.code = Code::PresetMissing;
  if (preset_ == nullptr) return;
  Result<FrameLease> lease = await_frame(request, first_exposure_us(request));
  if (!lease) {
    result.code = lease.error().code;
    return;
  }
  const DepthFrame& frame = lease.value().frame();
  note_frame(request, frame, outcome);
  const Code bad_frame = judge_frame(frame);
  if (bad_frame != Code::Ok) {
    result.code = bad_frame;
    return;
  }
  const Result<double> occupied =
      preset_->runner->occupied_share(frame, context_of(request, frame));
  if (!occupied) {
    result.code = occupied.error().code;
  } else {
    result.code = occupied.value() <= preset_->profile.max_occupied_share
                      ? Code::RoiConfirmedEmpty
                      : Code::UnexplainedForeground;
  }
  keep(std::move(lease.value()));
}

}  // namespace grapnel
