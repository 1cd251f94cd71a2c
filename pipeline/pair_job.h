#pragma once

#include <cstddef>

#include "base/arena.h"
#include "base/error.h"
#include "base/rng.h"
#include "pipeline/judge/covariance.h"
#include "pipeline/judge/overlap.h"
#include "pipeline/margin.h"
#include "pipeline/registrar_state.h"

namespace grapnel {

/// One job B: a view carried onto another, the steps in their order. Lives as long as the job.
class PairJob {
 public:
  PairJob(RegistrarState& state, const JobContext& context) noexcept;

  Result<RegistrationReports> run(const Surface& source, const Surface& target) noexcept;

 private:
  Status thin(const Surface& raw, double fine_m, ViewIndex& view) noexcept;
  Status thin_to(double leaf_m, Surface& out) noexcept;
  Status prepare(double spacing_m, ViewIndex& view) noexcept;
  Status describe(ViewIndex& view, std::uint64_t stream) noexcept;
  Status match(RegistrationReport& report) noexcept;
  void propose() noexcept;
  void settle() noexcept;
  void verify(const Surface& source, const Surface& target) noexcept;
  /// Of candidates that are not distinct the best is kept.
  void keep_candidate(const PairCandidate& candidate) noexcept;
  void judge(const Surface& source, const Surface& target, RegistrationReport& report) noexcept;
  [[nodiscard]] Result<RefinedPose> refine(PoseRefiner& refiner, const Surface& moving,
                                           double spacing_m,
                                           const Pose& target_from_source) noexcept;
  [[nodiscard]] bool distinct(const Pose& a, const Pose& b) const noexcept;
  [[nodiscard]] Margin margin() const noexcept;
  [[nodiscard]] ReadingErrors reading_errors(const Surface& target, double z_m,
                                             double sigma_m) const noexcept;
  [[nodiscard]] PoseScore rating(double tolerance_m) const noexcept;

  RegistrarState& s_;
  PairState& p_;
  const JobContext& context_;
  RegistrationReports reports_;
  JobWatch watch_;
  Rng rng_;
  double size_m_ = 0.0;           ///< of the smaller view
  Vec3d centre_ = Vec3d::Zero();  ///< of the source
};

}  // namespace grapnel
