#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "base/field.h"
#include "pipeline/neighbours/neighbour_search.h"
#include "pipeline/stage.h"

namespace grapnel {

struct FpfhParams {
  double radius_m = 0.0;  ///< 0 = auto: radius_ratio spacings
  double radius_ratio = 8.0;
  int max_neighbours = 0;  ///< of one point, thinned evenly beyond; 0 = the limits'. PCL: no cap
  Engine engine = Engine::Fast;
};

[[nodiscard]] FieldTable fpfh_fields() noexcept;

/// Fast point feature histograms, 3 × 11 bins (Rusu 2009, eq. 4 and 5), with PCL's particulars: the
/// neighbours' simplified histograms are weighted by the inverse *squared* distance, the point's
/// own is left out, each third is scaled to a sum of 100.
class FpfhEstimator final : public DescriptorEstimator {
 public:
  static constexpr std::size_t kBins = 11;
  static constexpr std::size_t kDimension = 3 * kBins;

  explicit FpfhEstimator(const FpfhParams& params) noexcept : params_(params) {}

  void reserve(Arena& arena, const Limits& limits) override;
  [[nodiscard]] std::size_t dimension() const noexcept override { return kDimension; }
  Status describe(const Surface& surface, std::span<const Keypoint> keypoints,
                  FeatureMatrix& features) noexcept override;

  /// The simplified histogram of one point of the last surface described, 33 bins; only of
  /// points near one of its keypoints.
  [[nodiscard]] std::span<const float> simplified(std::size_t point_i) const noexcept;

 private:
  void simplify(const Surface& surface, std::size_t point_i, float radius_m) noexcept;
  void weigh(std::size_t point_i, float radius_m, std::span<float> row) noexcept;

  FpfhParams params_;
  std::size_t max_neighbours_ = 0;
  NeighbourSearch search_;
  std::span<float> simplified_;
  std::span<std::uint8_t> needed_;
  std::span<std::int32_t> others_, bins_;
};

}  // namespace grapnel
