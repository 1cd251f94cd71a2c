#pragma once

#include <cstddef>
#include <span>

#include "base/field.h"
#include "base/geometry.h"
#include "pipeline/neighbours/neighbour_search.h"
#include "pipeline/stage.h"

namespace grapnel {

struct PcaNormalsParams {
  double radius_m = 0.0;  ///< 0 = auto: radius_ratio spacings
  double radius_ratio = 3.0;
  int k = 0;               ///< > 0: the k nearest (the point included) instead of a radius
  int min_neighbours = 5;  ///< the point included; fewer: no normal
};

[[nodiscard]] FieldTable pca_normals_fields() noexcept;

/// Least-squares plane through each point's neighbourhood: the eigenvector of the smallest
/// eigenvalue of its covariance (Rusu 2009, ch. 4.3). Turned toward the viewpoint, or away from the
/// centroid of a cloud without one. No normal (all zero) where too few neighbours are or the
/// neighbourhood is a line. Of a radius in single precision: right to about 1e-5 rad.
class PcaNormals final : public NormalEstimator {
 public:
  explicit PcaNormals(const PcaNormalsParams& params) noexcept : params_(params) {}

  void reserve(Arena& arena, const Limits& limits) override;
  Status estimate(Surface& surface) noexcept override;

  /// Surface variation l0/(l0+l1+l2) of each point of the last surface, 0…1/3; 0 without normal.
  [[nodiscard]] std::span<const float> curvature() const noexcept { return curvature_; }

 private:
  class Batch;

  void estimate_each(Surface& surface, double radius_m) noexcept;
  void estimate_in_blocks(Surface& surface, float radius_m) noexcept;
  void store(Surface& surface, std::size_t point_i, Vec3d normal, double variation) noexcept;

  PcaNormalsParams params_;
  Vec3d middle_ = Vec3d::Zero();  ///< viewpoint of the last surface, or its centroid
  NeighbourSearch search_;
  std::span<float> curvature_memory_;
  std::span<const float> curvature_;
};

}  // namespace grapnel
