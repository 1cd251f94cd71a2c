#include "pipeline/surface.h"

#include <bit>
#include <cstddef>

#include "base/hash.h"

namespace grapnel {

void Surface::reserve(Arena& arena, std::size_t max_points, std::size_t max_grid_pixels) {
  for (std::span<float>* plane : {&x, &y, &z, &nx, &ny, &nz, &intensity}) {
    *plane = arena.take<float>(max_points);
  }
  grid.point_of = arena.take<std::int32_t>(max_grid_pixels);
  grid.pixel_of = arena.take<std::int32_t>(max_grid_pixels > 0 ? max_points : 0);
}

bool Surface::all_finite() const noexcept {
  // By the exponents' bits, which needs no branch a point.
  constexpr std::uint32_t kExponent = 0x7f800000U;
  std::uint32_t bad = 0;
  for (const std::span<float>& plane : {x, y, z}) {
    for (std::size_t i = 0; i < size; ++i) {
      bad |= (std::bit_cast<std::uint32_t>(plane[i]) & kExponent) == kExponent ? 1U : 0U;
    }
  }
  return bad == 0;
}

void Surface::clear() noexcept {
  size = 0;
  grid.width = 0;
  grid.height = 0;
  has_viewpoint = false;
  spacing_m = 0.0;
}

Vec3d centroid(const Surface& surface) noexcept {
  Vec3d sum = Vec3d::Zero();
  for (std::size_t i = 0; i < surface.size; ++i) sum += surface.point(i).cast<double>();
  return surface.size == 0 ? sum : Vec3d(sum / static_cast<double>(surface.size));
}

std::uint64_t hash_points(const Surface& surface) noexcept {
  std::uint64_t hash = surface.size;
  for (const std::span<float> plane :
       {surface.x, surface.y, surface.z, surface.nx, surface.ny, surface.nz}) {
    hash = hash_bytes(std::as_bytes(plane.first(surface.size)), hash);
  }
  return hash;
}

}  // namespace grapnel
