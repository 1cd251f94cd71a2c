#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "base/field.h"
#include "pipeline/neighbours/dense_grid.h"
#include "pipeline/neighbours/neighbour_search.h"
#include "pipeline/stage.h"

namespace grapnel {

struct StatisticalOutlierParams {
  int k = 20;            ///< nearest other points
  double std_mul = 2.0;  ///< standard deviations above the mean that are still kept
  Engine engine = Engine::Fast;
};
[[nodiscard]] FieldTable statistical_outlier_fields() noexcept;

/// Removes points whose mean distance to their k nearest others exceeds the cloud's mean of it by
/// more than std_mul sample standard deviations (Rusu 2008; as PCL's StatisticalOutlierRemoval). On
/// a camera's grid the nearest are found in a window of pixels wherever the window proves that they
/// are; both engines find the same points, the fast one sums their distances in single precision.
class StatisticalOutliers final : public CloudFilter {
 public:
  explicit StatisticalOutliers(const StatisticalOutlierParams& params);

  /// Room for clouds of the limits' max_input_points.
  void reserve(Arena& arena, const Limits& limits) override;
  /// Errors: TooFewPoints (k or fewer), CapacityExceeded, BadParameter (not finite).
  Result<std::size_t> apply(Surface& surface) noexcept override;

  /// Mean distance of each point of the last surface, metres, before the removal.
  [[nodiscard]] std::span<const float> mean_distance_m() const noexcept { return mean_m_; }

 private:
  void measure_grid(const Surface& surface) noexcept;
  void measure_eight(const Surface& surface, int u, int v) noexcept;
  [[nodiscard]] float measure(const Surface& surface, std::size_t point_i) noexcept;

  StatisticalOutlierParams params_;
  kernels::WindowSelection near_;
  kernels::WindowSelection wide_;
  DenseGrid grid_;
  NeighbourSearch search_;
  std::span<float> memory_;
  std::span<float> mean_m_;
  std::span<std::uint8_t> keep_;
};

}  // namespace grapnel
