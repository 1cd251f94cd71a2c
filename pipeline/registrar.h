#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "base/clock.h"
#include "base/depth_frame.h"
#include "base/error.h"
#include "pipeline/belt_background.h"
#include "pipeline/preset.h"
#include "pipeline/report.h"
#include "pipeline/surface.h"

namespace grapnel {

/// Everything a job depends on beside the frame and the preset. Stored in a snapshot, a job replays
/// alone.
struct JobContext {
  BeltBackground background;
  std::uint32_t model_mask = 0xffffffffU;  ///< bit i = model i of the preset is wanted
  std::uint16_t max_objects = 0;           ///< 0 = preset value
  bool has_last_pick = false;
  Pose last_pick = Pose::Identity();  ///< camera_from_model of the last accepted pose
  bool has_initial = false;
  Pose initial = Pose::Identity();  ///< target_from_source to start from instead of searching

  const Clock* clock = nullptr;  ///< for stage times and the deadline; nullptr = no times
  std::int64_t deadline_us = 0;  ///< on that clock; 0 = none. Read at stage boundaries only
  const std::atomic<bool>* abort = nullptr;  ///< true = stop at the next stage boundary (Aborted)
};

/// Memory of one part of the plan.
struct MemoryItem {
  std::string part;
  std::size_t bytes = 0;
};

struct RegistrarState;

/// Depth in, pose out. All memory is one arena, carved at create(); run() allocates nothing and
/// gives the same bits for the same frame, preset and context on every machine. Not thread-safe:
/// one thread at a time.
class Registrar {
 public:
  /// Bytes a registrar of this preset needs, by part. Throws InputError when a stage's table is
  /// wrong.
  [[nodiscard]] static std::vector<MemoryItem> plan(const Preset& preset);
  [[nodiscard]] static std::size_t required_bytes(const Preset& preset);

  /// Builds every stage and carves `memory` (64-byte aligned, at least required_bytes()), which
  /// must outlive the registrar. Throws InputError.
  [[nodiscard]] static std::unique_ptr<Registrar> create(Preset preset,
                                                         std::span<std::byte> memory);
  /// The same with memory of its own (tools).
  [[nodiscard]] static std::unique_ptr<Registrar> create(Preset preset);
  ~Registrar();

  /// Job A: the preset's models against one frame. A rejection is a report, not an Error; errors
  /// are JobDeadline, Aborted, RoiEmpty, TooFewPoints and the like when there is no report to give.
  Result<RegistrationReports> run(const DepthFrame& frame, const JobContext& context) noexcept;

  /// Job A on a cloud: the preset's models against an unorganised (or organised) surface.
  Result<RegistrationReports> run(const Surface& scene, const JobContext& context) noexcept;

  /// Job B: `source` is carried onto `target`. Both are raw, as read: a camera's at full resolution
  /// with grid, intrinsics and viewpoint, a cloud's with normals where the file had them; the
  /// registrar filters, thins and describes them. The answer holds one object; counts, times and
  /// seed are as in run().
  Result<RegistrationReports> register_pair(const Surface& source, const Surface& target,
                                            const JobContext& context) noexcept;

  /// Share of the region of interest that stands above the belt (command 61).
  Result<double> occupied_share(const DepthFrame& frame, const JobContext& context) noexcept;

  [[nodiscard]] const Preset& preset() const noexcept;
  /// Arena bytes really used; equals required_bytes().
  [[nodiscard]] std::size_t used_bytes() const noexcept;
  /// Name of the SIMD target in use ("AVX2", …).
  [[nodiscard]] static const char* simd_target() noexcept;
  /// Forces a SIMD target by name. False when this machine or build lacks it.
  static bool force_simd_target(const std::string& name) noexcept;

 private:
  explicit Registrar(std::unique_ptr<RegistrarState> state);
  std::unique_ptr<RegistrarState> state_;
};

}  // namespace grapnel
