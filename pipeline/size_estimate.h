#pragma once

#include <cstdint>

#include "base/geometry.h"

namespace grapnel {

/// What a measured object looks like, whatever the model: so that a box or barrel of a size that
/// nobody taught can be told by its size.
struct SizeEstimate {
  enum class Shape : std::uint8_t { None, Box, Barrel };
  Shape shape = Shape::None;
  /// Box: length, width, height; length ≥ width, height along the ground's normal or, without a
  /// ground, along the largest face's. Barrel: diameter, diameter, length along its axis. Metres; 0
  /// = that side is not in sight.
  Vec3d size_m = Vec3d::Zero();
  double sigma_m = 0.0;  ///< expected error of one of them
};

/// "box", "barrel" or "none".
[[nodiscard]] const char* shape_name(SizeEstimate::Shape shape) noexcept;

}  // namespace grapnel
