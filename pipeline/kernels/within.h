#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace grapnel {

/// A stretch of consecutive points.
struct PointRange {
  std::int32_t begin = 0;
  std::int32_t end = 0;
};

namespace kernels {

/// Elements that the kernels may read behind an input's end and write behind an output's end.
inline constexpr std::size_t kSlack = 16;

/// Coordinates, each with kSlack readable elements behind the last point.
struct PointPlanes {
  const float* x = nullptr;
  const float* y = nullptr;
  const float* z = nullptr;
};

/// A sphere: centre in metres, radius squared in m².
struct Sphere {
  float x = 0.0F;
  float y = 0.0F;
  float z = 0.0F;
  float squared_m2 = 0.0F;
};

/// Positions and squared distances of the points in `ranges` that lie in the sphere, in the order
/// of the ranges. The outputs hold all points of the ranges plus kSlack. Returns their number.
std::size_t select_within(const PointPlanes& points, std::span<const PointRange> ranges,
                          const Sphere& sphere, std::int32_t* position, float* squared_m2) noexcept;

}  // namespace kernels
}  // namespace grapnel
