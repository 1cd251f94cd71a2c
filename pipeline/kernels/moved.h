#pragma once

#include <cstddef>
#include <cstdint>

#include "base/geometry.h"

namespace grapnel::kernels {

/// A rigid motion in single precision: rotation row by row, then the shift.
struct Motion {
  float r[9] = {1.0F, 0.0F, 0.0F, 0.0F, 1.0F, 0.0F, 0.0F, 0.0F, 1.0F};
  float t[3] = {};
};
[[nodiscard]] inline Motion motion_of(const Pose& pose) noexcept {
  Motion motion;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      motion.r[3 * row + column] = static_cast<float>(pose.linear()(row, column));
    }
    motion.t[row] = static_cast<float>(pose.translation()[row]);
  }
  return motion;
}

/// A box of cubic voxels; voxel (x, y, z) has index (z * size[1] + y) * size[0] + x.
struct VoxelShape {
  float origin[3] = {};
  float per_metre = 0.0F;
  std::int32_t size[3] = {};
};

/// Points are worked on in stretches of eight, whatever the vector's width: a sum has eight parts,
/// and part i takes elements i, i + 8, …
inline constexpr std::size_t kLanes = 8;
[[nodiscard]] constexpr std::size_t in_lanes(std::size_t count) noexcept {
  return (count + kLanes - 1) / kLanes * kLanes;
}
/// Parts 0+4, 1+5, …, then 0+2, 1+3, then 0+1.
[[nodiscard]] inline float fold_lanes(const float* s) noexcept {
  return ((s[0] + s[4]) + (s[2] + s[6])) + ((s[1] + s[5]) + (s[3] + s[7]));
}

}  // namespace grapnel::kernels
