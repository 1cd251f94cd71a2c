#pragma once

#include <array>
#include <cstddef>
#include <span>

#include "base/field.h"
#include "pipeline/neighbours/sphere_sums.h"
#include "pipeline/stage.h"

namespace grapnel {

struct CurvatureParams {
  Engine engine = Engine::Fast;
  double radius_m = 0.0;      ///< of the normals looked at; 0 = auto: radius_ratio spacings
  double radius_ratio = 4.0;  ///< × the spacing of the surface
};

[[nodiscard]] FieldTable curvature_fields() noexcept;

/// How the normals around each point spread in its tangent plane (PCL's
/// PrincipalCurvaturesEstimation): eigenvalues of the covariance of the normals projected onto it.
/// They are variances without unit and grow with the radius; not 1/m. Points without normal do not
/// count and get zeros.
class PrincipalCurvature final : public PipelineStage {
 public:
  explicit PrincipalCurvature(const CurvatureParams& params) noexcept : params_(params) {}

  void reserve(Arena& arena, const Limits& limits) override;
  /// Errors: TooFewPoints, CapacityExceeded, BadParameter (no radius).
  [[nodiscard]] Status estimate(const Surface& surface) noexcept;

  /// Of the last surface, a value a point: the larger and the smaller curvature, 0…1.
  [[nodiscard]] std::span<const float> largest() const noexcept { return pc1_.first(size_); }
  [[nodiscard]] std::span<const float> smallest() const noexcept { return pc2_.first(size_); }
  /// Unit direction of the larger one; its sign means nothing. Component 0, 1 or 2.
  [[nodiscard]] std::span<const float> direction(std::size_t axis) const noexcept {
    return direction_[axis].first(size_);
  }
  /// Radius used for the last surface.
  [[nodiscard]] double radius_m() const noexcept { return radius_m_; }
  /// Search over the last surface.
  [[nodiscard]] NeighbourSearch& search() noexcept { return sums_.search(); }

 private:
  void store(std::size_t point_i, const Vec3d& normal, const Symmetric3& covariance) noexcept;
  void estimate_fast(const Surface& surface) noexcept;
  void estimate_plainly(const Surface& surface) noexcept;

  CurvatureParams params_;
  SphereSums sums_;
  std::span<float> pc1_, pc2_;
  std::array<std::span<float>, 3> direction_;
  std::size_t size_ = 0;
  double radius_m_ = 0.0;
};

}  // namespace grapnel
