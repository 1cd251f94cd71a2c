#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "base/field.h"
#include "pipeline/kernels/block_pairs.h"
#include "pipeline/neighbours/neighbour_search.h"
#include "pipeline/stage.h"

namespace grapnel {

struct FpfhParams {
  double radius_m = 0.0;  ///< 0 = auto: radius_ratio spacings
  double radius_ratio = 8.0;
  /// Pairs of one point, thinned evenly beyond; 0 = the limits' max_neighbours. PCL: no cap.
  int max_neighbours = 0;
  Engine engine = Engine::Fast;
};

[[nodiscard]] FieldTable fpfh_fields() noexcept;

/// Fast point feature histograms, 3 × 11 bins (Rusu 2009, eq. 4 and 5), with PCL's particulars: the
/// neighbours' simplified histograms are weighted by the inverse *squared* distance, the point's
/// own is left out, each third is scaled to a sum of 100.
///
/// Every point is visited once: its simplified histogram goes at once to the keypoints around it,
/// so that one search is enough and no simplified histogram is stored. Points that lie together are
/// worked on together, a lane each, unless one of them has so many neighbours that they are
/// thinned.
class FpfhEstimator final : public DescriptorEstimator {
 public:
  static constexpr std::size_t kBins = 11;
  static constexpr std::size_t kDimension = 3 * kBins;

  explicit FpfhEstimator(const FpfhParams& params) noexcept : params_(params) {}

  void reserve(Arena& arena, const Limits& limits) override;
  [[nodiscard]] std::size_t dimension() const noexcept override { return kDimension; }
  Status describe(const Surface& surface, std::span<const Keypoint> keypoints,
                  FeatureMatrix& features) noexcept override;

  /// The simplified histogram of one point of the last surface described, 33 bins; valid until the
  /// next call. For tests of the definition.
  [[nodiscard]] std::span<const float> simplified(const Surface& surface,
                                                  std::size_t point_i) noexcept;

 private:
  void arrange(const Surface& surface, std::span<const Keypoint> keypoints) noexcept;
  [[nodiscard]] bool has_normal(std::size_t position) const noexcept {
    const float* normal = points_.data() + position * kernels::kOrientedRow + 3;
    return normal[0] != 0.0F || normal[1] != 0.0F || normal[2] != 0.0F;
  }
  /// Adds what a block's points say to the rows around them; false where some must be looked at one
  /// by one.
  [[nodiscard]] bool add_block(const kernels::BlockOfPoints& block,
                               FeatureMatrix& features) noexcept;
  void add_point(std::size_t position, FeatureMatrix& features) noexcept;
  /// The rows around a point and their weights. Returns how many.
  std::size_t rows_around(const Neighbourhood& around) noexcept;
  /// Fills histogram_ (or plain_) of the point at a position; false when it has no pairs.
  bool simplify(std::size_t position, const Neighbourhood& around) noexcept;
  [[nodiscard]] std::span<const std::int32_t> partners_of(
      std::span<const std::int32_t> around) noexcept;
  void count_fast(std::size_t position, std::span<const std::int32_t> others) noexcept;
  void count_plain(std::size_t position, std::span<const std::int32_t> others) noexcept;
  void add_to_rows(std::size_t count, FeatureMatrix& features) noexcept;
  /// From the order of the positions to that of the keypoints.
  void move_rows(FeatureMatrix& features) noexcept;
  void finish_rows(std::span<const Keypoint> keypoints, FeatureMatrix& features) noexcept;

  FpfhParams params_;
  std::size_t max_neighbours_ = 0;
  float radius_m_ = 0.0F;
  bool all_normals_ = false;
  NeighbourSearch search_;
  std::span<float> points_;                    // rows of kOrientedRow, by position
  std::span<std::int32_t> keypoint_of_point_;  // -1: none
  // Sums of keypoints near one another lie near one another, in the order of their positions.
  std::span<std::int32_t> row_at_;       // of each position; -1: no keypoint
  std::span<std::int32_t> keypoint_of_;  // of each row
  std::size_t row_count_ = 0;
  std::span<std::int32_t> others_, bins_, rows_;
  std::span<float> weights_;
  std::array<float, 40> histogram_{};  // 33 bins, padded for the weighted sum
  kernels::NearBlock near_;
  std::array<kernels::PairBinCounts, kernels::kBlock> counts_{};
  kernels::BlockRows block_rows_{};
  std::array<double, kDimension> plain_{};
  std::span<double> plain_sums_;  // a row a keypoint; reference engine only
};

}  // namespace grapnel
