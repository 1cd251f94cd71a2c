#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "pipeline/kernels/pair_features.h"

namespace grapnel::kernels {

/// A spin image's frame: its point and axis, and how distances and angles become cells.
struct SpinFrame {
  float x = 0.0F, y = 0.0F, z = 0.0F;     ///< point, metres
  float nx = 0.0F, ny = 0.0F, nz = 0.0F;  ///< axis, unit
  float min_cos = 0.0F;  ///< normals that lean farther from the axis's line are left out
  float cell_m = 0.0F;   ///< edge of a cell
  int width = 8;         ///< the image has width + 1 rows and 2 width + 1 columns
  bool radial = false;   ///< distance and elevation in place of distance from and along the axis
  bool angular = false;  ///< fills `angle_rad`
};

/// Where one neighbour votes: the cell with its share of the next row and column, or cell -1.
struct SpinVotes {
  std::int32_t* cell = nullptr;
  float* to_next_row = nullptr;
  float* to_next_column = nullptr;
  float* angle_rad = nullptr;  ///< between the lines of the two normals
};

/// Votes of `others` (Johnson and Hebert 1999, eq. 2; PCL's computeSiForPoint). The point itself
/// and points outside the cylinder have none. The outputs hold others.size() + 8 elements.
void spin_votes(const OrientedPlanes& points, const SpinFrame& frame,
                std::span<const std::int32_t> others, const SpinVotes& votes) noexcept;

}  // namespace grapnel::kernels
