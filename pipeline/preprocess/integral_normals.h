#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "base/field.h"
#include "pipeline/preprocess/integral_image.h"
#include "pipeline/stage.h"

namespace grapnel {

struct IntegralNormalsParams {
  enum class By : std::uint8_t {
    CovarianceMatrix,    ///< flattest direction of the window's points
    Average3dGradient,   ///< across the window's mean steps along a row and along a column
    AverageDepthChange,  ///< the same of its mean points left and right, above and below
    Simple3dGradient     ///< the same of its outermost columns and rows
  };
  By by = By::Average3dGradient;
  double smoothing_px = 10.0;  ///< edge of the window where no step is near
  /// A step between neighbouring pixels, over twice (depth + 1 m): windows shrink so that none
  /// reaches over it.
  double max_depth_change = 0.02;
};
[[nodiscard]] FieldTable integral_normals_fields() noexcept;

/// Normals of an organised surface by sums over windows of pixels, whose cost does not grow with
/// the window (Holzer, Rusu, Dixon, Gedikli and Navab 2012; PCL's IntegralImageNormalEstimation).
/// Each window is as wide as it is far to the next step in depth, to the next pixel without
/// reading and to the image's border, at most smoothing_px; one of two pixels or less gives no
/// normal (all zero). Toward the viewpoint.
class IntegralNormals final : public NormalEstimator {
 public:
  explicit IntegralNormals(const IntegralNormalsParams& params) noexcept : params_(params) {}

  void reserve(Arena& arena, const Limits& limits) override;
  /// Errors: TooFewPoints, CapacityExceeded, BadParameter (no grid, a coordinate not finite).
  Status estimate(Surface& surface) noexcept override;

 private:
  void measure_distances(const Surface& surface) noexcept;
  void sum_up(const Surface& surface) noexcept;
  /// Not of unit length; zero = none.
  [[nodiscard]] Vec3d by_covariance(const PixelWindow& window) const noexcept;
  [[nodiscard]] Vec3d by_gradient(const PixelWindow& window) const noexcept;
  [[nodiscard]] Vec3d by_depth_change(int u, int v, int edge) const noexcept;
  [[nodiscard]] Vec3d by_outermost(const PixelWindow& window) const noexcept;
  [[nodiscard]] Vec3d normal_at(int u, int v, int edge) const noexcept;

  IntegralNormalsParams params_;
  IntegralImage along_;           ///< points, or steps along rows
  IntegralImage down_;            ///< steps along columns
  std::span<float> distance_px_;  ///< of each pixel to the next step or hole
};

}  // namespace grapnel
