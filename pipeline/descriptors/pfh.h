#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "base/field.h"
#include "pipeline/kernels/pair_features.h"
#include "pipeline/neighbours/neighbour_search.h"
#include "pipeline/stage.h"

namespace grapnel {

struct PfhParams {
  double radius_m = 0.0;  ///< 0 = auto: radius_ratio spacings
  double radius_ratio = 8.0;
  int bins = 5;             ///< of each of the three features
  int max_neighbours = 64;  ///< thinned evenly beyond; 0 = the limits'. PCL: no cap
  Engine engine = Engine::Fast;
};
[[nodiscard]] FieldTable pfh_fields() noexcept;

/// Point feature histograms (Rusu 2009, eq. 3; PCL's PFHEstimation): all pairs of the points around
/// a keypoint, itself included, counted by their three angular features. Sums to 100, less the
/// pairs without features. O(keypoints × neighbours²).
class PfhEstimator final : public DescriptorEstimator {
 public:
  explicit PfhEstimator(const PfhParams& params) noexcept : params_(params) {}

  void reserve(Arena& arena, const Limits& limits) override;
  [[nodiscard]] std::size_t dimension() const noexcept override;
  Status describe(const Surface& surface, std::span<const Keypoint> keypoints,
                  FeatureMatrix& features) noexcept override;

 private:
  /// The neighbours with normals, copied side by side. Returns their number.
  std::size_t gather(const Surface& surface, std::size_t point_i, float radius_m) noexcept;
  void count_fast(std::size_t count) noexcept;
  void count_plain(std::size_t count) noexcept;

  PfhParams params_;
  std::size_t max_neighbours_ = 0;
  NeighbourSearch search_;
  std::array<std::span<float>, 6> around_;  ///< x, y, z, nx, ny, nz
  std::array<std::span<std::uint32_t>, kernels::kPairCellTables> counts_;
};

}  // namespace grapnel
