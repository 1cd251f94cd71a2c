#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "base/error.h"
#include "base/fixed_list.h"
#include "base/geometry.h"
#include "pipeline/size_estimate.h"

namespace grapnel {

/// What a verdict looks at. Each belongs to one status code; some codes have several checks.
enum class Check : std::uint8_t {
  MatchedShare,
  MatchedArea,
  SeenThrough,
  Hole,
  Deviation,
  Unknown,
  Outside,
  Unexplained,
  Explained,
  OutlineKnown,
  Outline,
  FlatProof,
  Overlap,
  Margin,
  Shift,
  Turn,
  BeltKnown,
  BeltDistance,
  Support,
  Size,
  SharedSpace,
  GraspWhole,
  GraspSize,
  GraspHeight,
  GraspPatch,
  GraspFlat,
  Stray,
  LeftOver,
  Sunk,
  LeastShare,
  Ground,
  Mirror,
  Height,
  kCount
};

/// One failed check: what was measured and what the limit is, in the check's own unit (share,
/// metres, square metres, radians); reason_text() writes the sentence.
struct Reason {
  Check check = Check::MatchedShare;
  double measured = 0.0;
  double limit = 0.0;

  [[nodiscard]] Code code() const noexcept;
};

/// Sizes along the way.
struct StageCounts {
  std::uint32_t source_points = 0;
  std::uint32_t target_points = 0;
  std::uint32_t source_keypoints = 0;
  std::uint32_t target_keypoints = 0;
  std::uint32_t correspondences = 0;
  std::uint32_t after_rejection = 0;
  std::uint32_t hypotheses = 0;
};

/// Time spent per stage, microseconds, index = Stage. Not part of what must replay byte for byte.
using StageTimes = std::array<std::uint32_t, static_cast<std::size_t>(Stage::kCount)>;

/// What every check measured, index = Check, in the check's own unit; NaN = not looked at.
struct Measured {
  std::array<float, static_cast<std::size_t>(Check::kCount)> value;

  Measured() noexcept { value.fill(std::numeric_limits<float>::quiet_NaN()); }
  float& operator[](Check check) noexcept { return value[static_cast<std::size_t>(check)]; }
  float operator[](Check check) const noexcept { return value[static_cast<std::size_t>(check)]; }
};

/// The answer about one object: a pose never travels without its verdict.
struct RegistrationReport {
  bool accepted = false;
  /// ObjectFound, SurfaceGrasp, or the first failing reason.
  Code code = Code::NoObjectAccepted;
  InlineList<Reason, 16> reasons;  ///< every failing check, empty when accepted
  std::uint32_t model = 0;         ///< index in the preset's list of models
  std::uint32_t pieces = 0;        ///< of a frame: bit i = i-th connected piece that was looked at
  Pose target_from_source =
      Pose::Identity();  ///< the best pose found, also when rejected; see has_pose
  bool has_pose = false;
  bool surface_grasp = false;                 ///< not accepted, but the object's top offers a grasp
  Pose target_from_grasp = Pose::Identity();  ///< that grasp: z into the surface
  /// The pose that it can't be told from, where that is why it is rejected (Check::Margin).
  bool has_rival = false;
  Pose target_from_rival = Pose::Identity();
  double fitness = 0.0;   ///< matched share of the visible model where there is a reading, 0…1
  double rmse_m = 0.0;    ///< point-to-plane, of the matched samples
  double coverage = 0.0;  ///< share of the whole model confirmed (pairs: overlap), 0…1
  double free_space_violation = 0.0;  ///< share of visible samples the camera sees through, 0…1
  double occluded = 0.0;              ///< share of visible samples behind something nearer
  double unknown = 0.0;               ///< share of visible samples without a reading
  double margin = 0.0;                ///< 1 - S2/S1 to the best distinct pose; 0 = ambiguous
  double sigma_m = 0.0;               ///< predicted 1-σ in the weakest required direction
  double sigma_rad = 0.0;
  Measured measured;
  SizeEstimate size;            ///< of the object, whatever the model; where the preset asks for it
  double quality = 0.0;         ///< 0…1, monotone in the checks
  bool symmetric = false;       ///< the model declares a symmetry
  bool budget_reached = false;  ///< some fixed capacity or count budget cut the search
  Mat6d covariance =
      Mat6d::Zero();  ///< of (translation, rotation) at the target frame's origin, m², rad²
  std::uint32_t iterations = 0;
  bool converged = false;
  StageCounts counts;
};

/// The answer to one job: up to eight objects, best first, and what belongs to the job as a whole.
struct RegistrationReports {
  InlineList<RegistrationReport, 8> objects;
  Code code =
      Code::NoObjectAccepted;  ///< RES_CODE: ObjectFound, RoiEmpty, the best object's code, …
  std::uint32_t found = 0;     ///< objects seen: accepted ones, and what else stands on the belt; a
                               ///< piece that several touching parts make counts as one
  std::uint32_t seed = 0;
  StageCounts counts;  ///< of the job; the objects hold their own
  StageTimes stage_us{};
  std::uint32_t total_us = 0;  ///< frame in memory → verdict, by the clock handed in
};

/// Name of a check in files: "matched_share".
[[nodiscard]] const char* name_of(Check check) noexcept;

/// "matched share of the visible model 0.41, at least 0.70 is required": one sentence without full
/// stop. Returns the number of characters written into `text` (at most `bytes` - 1, always
/// terminated).
std::size_t reason_text(const Reason& reason, char* text, std::size_t bytes) noexcept;

}  // namespace grapnel
