#pragma once

#include <atomic>
#include <cstdint>

#include "base/clock.h"
#include "firmware_app/background.h"
#include "firmware_app/job.h"
#include "firmware_app/job_evidence.h"
#include "firmware_app/job_runner.h"
#include "firmware_app/settings.h"
#include "hal/camera.h"
#include "hal/frame_pool.h"

namespace grapnel {

/// What the executor works with; all of it outlives the executor.
struct ExecutorParts {
  const Clock* clock = nullptr;
  FramePool* pool = nullptr;
  Camera* camera = nullptr;
  Background* background = nullptr;
  JobExchange* exchange = nullptr;
  std::atomic<std::uint64_t>* progress = nullptr;  ///< counted up while the thread is alive
  std::atomic<Stage>* stage = nullptr;             ///< told the stage that runs, None between jobs
  EvidenceSlot* evidence = nullptr;                ///< nullptr: no snapshots
  bool snapshot_on_reject = true;
};

/// Carries one job out: chooses the frame by the trigger's time, runs the pipeline, turns reports
/// into an answer. Runs on the registration thread; allocates nothing.
class JobExecutor {
 public:
  JobExecutor(const ExecutorParts& parts, const CaptureSettings& capture, int learn_frames);

  /// At a job's boundary. `preset` may be nullptr: jobs then answer PresetMissing.
  void use(ActivePreset* preset) noexcept { preset_ = preset; }
  void execute(const JobRequest& request, JobOutcome& outcome) noexcept;
  /// After the outcome is published: hands the job over to be saved where that was asked for.
  void hand_over(const JobRequest& request) noexcept;

 private:
  /// Counts each look at the clock as a sign of life: the pipeline looks at every stage boundary.
  class WatchedClock final : public Clock {
   public:
    WatchedClock(const Clock& clock, std::atomic<std::uint64_t>& progress) noexcept
        : clock_(&clock), progress_(&progress) {}
    [[nodiscard]] std::int64_t now_us() const noexcept override {
      progress_->fetch_add(1, std::memory_order_relaxed);
      return clock_->now_us();
    }
    void sleep_until_us(std::int64_t until_us) const noexcept override {
      clock_->sleep_until_us(until_us);
    }

   private:
    const Clock* clock_;
    std::atomic<std::uint64_t>* progress_;
  };

  void run_register(const JobRequest& request, JobOutcome& outcome) noexcept;
  [[nodiscard]] Code attempt(const JobRequest& request, const FrameLease& lease,
                             std::uint16_t extra_quality, JobOutcome& outcome) noexcept;
  void run_capture(const JobRequest& request, JobOutcome& outcome) noexcept;
  void run_learn(const JobRequest& request, JobOutcome& outcome) noexcept;
  void run_check_empty(const JobRequest& request, JobOutcome& outcome) noexcept;
  void run_save(const JobRequest& request, JobOutcome& outcome) noexcept;

  /// The frame of the job: the last capture, or the chosen one exposed from `not_before_us` on.
  [[nodiscard]] Result<FrameLease> await_frame(const JobRequest& request,
                                               std::int64_t not_before_us) noexcept;
  /// Next frame of a camera that hands them out on request; nothing for one that free-runs.
  void request_frame(std::int64_t not_before_us) noexcept;
  [[nodiscard]] Code judge_frame(const DepthFrame& frame) const noexcept;
  [[nodiscard]] std::int64_t first_exposure_us(const JobRequest& request) const noexcept;
  [[nodiscard]] JobContext context_of(const JobRequest& request, const DepthFrame& frame) noexcept;
  void note_frame(const JobRequest& request, const DepthFrame& frame, JobOutcome& outcome) noexcept;
  void keep(FrameLease lease) noexcept { last_capture_ = std::move(lease); }
  void remember(const JobRequest& request, const DepthFrame& frame, const JobContext& context,
                const Result<RegistrationReports>& answer) noexcept;

  ExecutorParts parts_;
  WatchedClock clock_;
  CaptureSettings capture_;
  int learn_frames_;
  ActivePreset* preset_ = nullptr;
  FrameLease last_capture_;
  bool has_evidence_ = false;  // of the last registration, whose frame is last_capture_
  JobEvidence evidence_;
  std::int64_t frame_at_us_ = 0;  // when the job's frame was in hand
  std::int64_t mid_exposure_us_ = 0;
};

}  // namespace grapnel
