#include "pipeline/surface.h"

namespace grapnel {

void Surface::reserve(Arena& arena, std::size_t max_points, std::size_t max_grid_pixels) {
  for (std::span<float>* plane : {&x, &y, &z, &nx, &ny, &nz, &intensity}) {
    *plane = arena.take<float>(max_points);
  }
  grid.point_of = arena.take<std::int32_t>(max_grid_pixels);
  grid.pixel_of = arena.take<std::int32_t>(max_grid_pixels > 0 ? max_points : 0);
}

void Surface::clear() noexcept {
  size = 0;
  grid.width = 0;
  grid.height = 0;
  has_viewpoint = false;
  spacing_m = 0.0;
}

}  // namespace grapnel
