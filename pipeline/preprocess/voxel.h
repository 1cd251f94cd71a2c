#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "base/field.h"
#include "pipeline/neighbours/cell_order.h"
#include "pipeline/neighbours/neighbour_search.h"
#include "pipeline/stage.h"

namespace grapnel {

struct VoxelParams {
  double leaf_m = 0.0;  ///< edge of a cell; 0 = auto: the finest that leaves at most max_points
  int max_points = 6000;
};

[[nodiscard]] FieldTable voxel_fields() noexcept;

/// Replaces the points of each cubic cell by their centroid; normals are averaged and made unit
/// again, intensities averaged. Cells are counted from the floor of the cloud's minimum and come
/// out in the order of their linear index, x fastest, as in PCL's VoxelGrid. The grid of an
/// organised surface is dropped. spacing_m becomes the leaf, or the mean distance to the nearest
/// point where the cloud is sparser. With an automatic leaf a cloud of at most max_points stays as
/// it is.
class VoxelGrid final : public CloudFilter {
 public:
  explicit VoxelGrid(const VoxelParams& params) noexcept : params_(params) {}

  /// Room for clouds of the limits' max_input_points.
  void reserve(Arena& arena, const Limits& limits) override;
  Result<std::size_t> apply(Surface& surface) noexcept override;
  /// The same with another leaf or number of points than the parameters'; 0 = as above.
  Result<std::size_t> apply(Surface& surface, double leaf_m, std::size_t max_points) noexcept;

 private:
  double leaf_for(const Surface& surface, std::size_t max_points) noexcept;
  bool average(std::size_t size, std::span<float> plane) noexcept;
  void merge_cells(Surface& surface) noexcept;
  double measured_spacing_m(const Surface& surface, double leaf_m) noexcept;

  VoxelParams params_;
  CellOrder cells_;
  std::span<std::uint32_t> count_;  // points of each cell
  std::span<double> sum_;           // of one value over each cell
  NeighbourSearch search_;
  std::size_t max_searched_ = 0;
};

}  // namespace grapnel
