#include "pipeline/kernels/reference.h"

#include <algorithm>
#include <array>
#include <cstdlib>

namespace grapnel::kernels::reference {

std::size_t select_within(const PointPlanes& points, std::span<const PointRange> ranges,
                          const Sphere& sphere, std::int32_t* position,
                          float* squared_m2) noexcept {
  std::size_t found = 0;
  for (const PointRange& range : ranges) {
    for (std::int32_t i = range.begin; i < range.end; ++i) {
      const float dx = points.x[i] - sphere.x;
      const float dy = points.y[i] - sphere.y;
      const float dz = points.z[i] - sphere.z;
      const float squared = (dx * dx + dy * dy) + dz * dz;
      if (squared > sphere.squared_m2) continue;
      position[found] = i;
      squared_m2[found++] = squared;
    }
  }
  return found;
}

void median_row(const std::uint16_t* const* rows, int window, std::size_t width,
                std::uint16_t* out) noexcept {
  const auto side = static_cast<std::size_t>(window);
  for (std::size_t u = 0; u < width; ++u) {
    std::array<std::uint16_t, 25> readings{};
    std::size_t count = 0;
    for (std::size_t i = 0; i < side * side; ++i) {
      const std::uint16_t reading = rows[i / side][u + i % side];
      if (reading != 0) readings[count++] = reading;
    }
    std::sort(readings.begin(), readings.begin() + static_cast<std::ptrdiff_t>(count));
    out[u] = rows[side / 2][u + side / 2] == 0 ? std::uint16_t{0} : readings[count / 2];
  }
}

std::size_t support_row(const std::uint16_t* above, const std::uint16_t* row,
                        const std::uint16_t* below, const GapLaw& gap, int min_support,
                        std::size_t width, std::uint16_t* out) noexcept {
  const std::array<const std::uint16_t*, 3> from = {above, row, below};
  std::size_t removed = 0;
  for (std::size_t u = 0; u < width; ++u) {
    const std::uint16_t centre = row[u + 1];
    const auto depth = static_cast<float>(centre);
    const int allowed = static_cast<int>(depth * (gap.linear + gap.quadratic * depth)) + 1;
    int support = 0;
    for (std::size_t i = 0; i < 9; ++i) {
      const std::uint16_t other = from[i / 3][u + i % 3];
      if (i != 4 && other != 0 && std::abs(centre - other) <= allowed) ++support;
    }
    const bool drop = centre != 0 && support < min_support;
    out[u] = drop ? std::uint16_t{0} : centre;
    removed += drop ? 1U : 0U;
  }
  return removed;
}

void back_project_row(const std::uint16_t* depth, const RowCamera& camera, std::size_t width,
                      float* x, float* y, float* z) noexcept {
  for (std::size_t u = 0; u < width; ++u) {
    z[u] = static_cast<float>(depth[u]) * camera.metres_per_unit;
    x[u] = (static_cast<float>(u) - camera.cx) * camera.inverse_fx * z[u];
    y[u] = camera.y_over_z * z[u];
  }
}

}  // namespace grapnel::kernels::reference
