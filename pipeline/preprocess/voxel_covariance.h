#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "base/field.h"
#include "pipeline/neighbours/cell_order.h"
#include "pipeline/neighbours/symmetric3.h"
#include "pipeline/stage.h"

namespace grapnel {

struct VoxelCovarianceParams {
  double leaf_m = 0.02;  ///< edge of a cell
  int min_points = 6;    ///< of a cell; one with fewer gives nothing (PCL: 6)
  /// The smallest eigenvalue of a cell's covariance, over its largest, that is left as it is;
  /// smaller ones are raised to it (Magnusson 2009, eq. 6.11; PCL: 0.01).
  double min_eigenvalue_ratio = 0.01;
};
[[nodiscard]] FieldTable voxel_covariance_fields() noexcept;

/// Replaces the points of each cubic cell by the normal distribution that they were drawn from, as
/// PCL's VoxelGridCovariance: their mean, and their covariance, whose flattest direction becomes
/// the point's normal (toward the viewpoint, away from the centroid without one). Cells as those of
/// VoxelGrid, in its order. What has too few points to have a covariance, such as flying pixels,
/// goes. Intensities are averaged. The grid of an organised surface is dropped; spacing_m becomes
/// the leaf. O(n).
class VoxelCovariance final : public CloudFilter {
 public:
  explicit VoxelCovariance(const VoxelCovarianceParams& params) noexcept : params_(params) {}

  /// Room for clouds of the limits' max_input_points.
  void reserve(Arena& arena, const Limits& limits) override;
  /// Errors: TooFewPoints (also: no cell with enough of them), CapacityExceeded, BadParameter (not
  /// finite, or a leaf too small for the cloud's extent).
  Result<std::size_t> apply(Surface& surface) noexcept override;

  /// Of each point of the last surface, m².
  [[nodiscard]] std::span<const Symmetric3> covariances() const noexcept { return covariances_; }

 private:
  struct Cell {
    Vec3f mean = Vec3f::Zero();
    Vec3f normal = Vec3f::Zero();
    float intensity = 0.0F;
  };
  /// False where the points span no volume, plane or line.
  [[nodiscard]] bool measure(const Surface& surface, std::span<const std::uint64_t> points,
                             Cell& cell, Symmetric3& covariance) const noexcept;

  VoxelCovarianceParams params_;
  CellOrder cells_;
  std::size_t max_points_ = 0;
  std::span<Cell> found_;
  std::span<Symmetric3> memory_;
  std::span<const Symmetric3> covariances_;
};

}  // namespace grapnel
