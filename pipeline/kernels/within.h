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

/// Moments of the points in a sphere about its centre: number, sums and sums of products.
struct SphereMoments {
  float count = 0.0F;
  float x = 0.0F, y = 0.0F, z = 0.0F;
  float xx = 0.0F, xy = 0.0F, xz = 0.0F, yy = 0.0F, yz = 0.0F, zz = 0.0F;
};

inline constexpr int kPartials = 8;
inline constexpr int kMoments = 10;
/// The eight partial sums of each moment, in the order of SphereMoments.
struct PartialMoments {
  float sum[kMoments][kPartials];
};
/// Adds the partial sums: 0+4, 1+5, …, then 0+2, 1+3, then 0+1.
[[nodiscard]] SphereMoments fold(const PartialMoments& partial) noexcept;

/// Adds the points of the ranges to the eight partial sums (position in its range modulo eight):
/// the same bits for every width of vector.
void add_sphere_moments(const PointPlanes& points, std::span<const PointRange> ranges,
                        const Sphere& sphere, PartialMoments& partial) noexcept;

}  // namespace kernels
}  // namespace grapnel
