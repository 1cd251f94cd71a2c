#pragma once

#include <atomic>
#include <cstdint>
#include <span>

#include "base/arena.h"
#include "base/depth_frame.h"
#include "base/error.h"
#include "base/signal.h"
#include "firmware_app/job.h"
#include "pipeline/registrar.h"
#include "pipeline/report.h"

namespace grapnel {

/// What the PLC said of a grasp (commands 51, 52).
enum class GraspLabel : std::uint8_t { None, Good, Bad };

/// A registration with all it depended on. The pixels are the slot's own.
struct JobEvidence {
  std::uint32_t job = 0;     ///< number of the job since start
  std::uint32_t origin = 0;  ///< of the preset: ActivePreset::origin
  PlcCommand command;
  PlcResult result;
  GraspLabel label = GraspLabel::None;
  DepthFrame frame;
  JobContext context;
  bool reported = false;
  Code code = Code::Ok;  ///< of a job without reports
  Stage stage = Stage::None;
  RegistrationReports reports;
};

/// Hands one job's evidence from the registration thread to the thread that saves it. The pixels
/// are copied into memory of its own, so that neither capture nor a newly learned belt waits for a
/// disk.
class EvidenceSlot {
 public:
  void reserve(Arena& arena, int max_width, int max_height, bool with_color);

  /// Registration thread. False while the last one is still being saved.
  bool put(const JobEvidence& evidence) noexcept;
  /// Saving thread: nullptr when there is none.
  [[nodiscard]] const JobEvidence* peek() const noexcept {
    return full_.load(std::memory_order_acquire) ? &evidence_ : nullptr;
  }
  void release() noexcept { full_.store(false, std::memory_order_release); }
  /// Notified by put().
  [[nodiscard]] Signal& arrived() noexcept { return arrived_; }

 private:
  JobEvidence evidence_;
  std::span<std::uint16_t> depth_;
  std::span<Rgb8> color_;
  std::span<std::uint16_t> background_;
  std::atomic<bool> full_{false};
  Signal arrived_;
};

}  // namespace grapnel
