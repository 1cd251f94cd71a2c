#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "base/field.h"
#include "pipeline/stage.h"

namespace grapnel {

struct CovarianceSamplingParams {
  int points = 2000;  ///< left; of a smaller cloud every point that has a normal stays
};
[[nodiscard]] FieldTable covariance_sampling_fields() noexcept;

/// Leaves the points that fix a pose best (Gelfand, Ikemoto, Rusinkiewicz and Levoy 2003): each in
/// turn is the one that says most about the motion that those taken so far say least about. A
/// motion is an eigenvector of the information that point-to-plane constraints of all points have
/// about a small motion, lengths in mean distances from the centroid. PCL's CovarianceSampling; the
/// points left keep their order. Points without a normal go. O(n log n).
class CovarianceSampling final : public CloudFilter {
 public:
  explicit CovarianceSampling(const CovarianceSamplingParams& params) noexcept : params_(params) {}

  /// Room for clouds of the limits' max_input_points.
  void reserve(Arena& arena, const Limits& limits) override;
  /// Errors: TooFewPoints (also: no point with a normal), CapacityExceeded, BadParameter (not
  /// finite).
  Result<std::size_t> apply(Surface& surface) noexcept override;

 private:
  struct Entry {
    double worth = 0.0;
    std::uint32_t point = 0;
  };
  static constexpr std::size_t kMotions = 6;

  CovarianceSamplingParams params_;
  std::span<std::uint8_t> keep_;
  std::span<Entry> entries_;                                 ///< of one motion, while sorting
  std::array<std::span<std::uint32_t>, kMotions> by_worth_;  ///< points, most first
};

/// Largest over smallest eigenvalue of that information, of the points that have a normal: how well
/// the surface fixes a pose, 1 = all motions alike. Infinite where a motion stays free, 0 without a
/// point. O(n).
[[nodiscard]] double covariance_condition(const Surface& surface) noexcept;

}  // namespace grapnel
