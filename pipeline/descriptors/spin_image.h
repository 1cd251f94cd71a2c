#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "base/field.h"
#include "pipeline/kernels/spin_cells.h"
#include "pipeline/neighbours/neighbour_search.h"
#include "pipeline/stage.h"

namespace grapnel {

/// What a cell's row and column stand for.
enum class SpinStructure : std::uint8_t {
  Rectangular,  ///< distance from the axis, distance along it
  Radial,       ///< distance from the point, elevation above the tangent plane
};
/// What a cell holds.
enum class SpinDomain : std::uint8_t {
  Density,  ///< share of the votes; the image sums to 1
  Angular,  ///< mean angle between the voters' normals and the axis, radians
};

struct SpinImageParams {
  double radius_m = 0.0;  ///< 0 = auto: radius_ratio spacings
  double radius_ratio = 8.0;
  int width = 8;
  SpinStructure structure = SpinStructure::Rectangular;
  SpinDomain domain = SpinDomain::Density;
  double min_cos = 0.0;            ///< PCL's support angle: cosine between the normals' lines
  std::size_t min_neighbours = 0;  ///< fewer, the point itself counted: not described
  int max_neighbours = 0;          ///< thinned evenly beyond; 0 = the limits'. PCL: no cap
  Engine engine = Engine::Fast;
};
[[nodiscard]] FieldTable spin_image_fields() noexcept;

/// Spin images (Johnson and Hebert 1999) as PCL's SpinImageEstimation makes them: (width + 1) ×
/// (2 width + 1) cells, rows by distance, votes shared bilinearly.
class SpinImageEstimator final : public DescriptorEstimator {
 public:
  explicit SpinImageEstimator(const SpinImageParams& params) noexcept : params_(params) {}

  void reserve(Arena& arena, const Limits& limits) override;
  [[nodiscard]] std::size_t dimension() const noexcept override;
  Status describe(const Surface& surface, std::span<const Keypoint> keypoints,
                  FeatureMatrix& features) noexcept override;

 private:
  [[nodiscard]] bool uses_normals() const noexcept {
    return params_.min_cos > 0.0 || params_.domain == SpinDomain::Angular;
  }
  std::size_t gather(const Surface& surface, const Neighbourhood& around) noexcept;
  void vote_fast(const Surface& surface, std::size_t point_i, double radius_m,
                 std::size_t count) noexcept;
  void vote_plain(const Surface& surface, std::size_t point_i, double radius_m,
                  std::size_t count) noexcept;
  /// One vote of weight 1 and its angle, over four cells.
  template <class Real>
  void add_vote(std::span<Real> votes, std::span<Real> angles, std::size_t cell, Real to_next_row,
                Real to_next_column, Real angle_rad) const noexcept;
  template <class Real>
  void finish(std::span<const Real> votes, std::span<const Real> angles,
              std::span<float> row) const noexcept;

  SpinImageParams params_;
  std::size_t max_neighbours_ = 0;
  NeighbourSearch search_;
  std::span<std::int32_t> others_, cells_;
  std::span<float> to_next_row_, to_next_column_, angle_rad_;
  std::span<float> votes_, angles_;
  std::span<double> plain_votes_, plain_angles_;
};

}  // namespace grapnel
