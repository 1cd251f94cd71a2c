#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/geometry.h"
#include "base/image.h"

namespace grapnel {

/// A cloud as a file holds it: one array a coordinate, metres as far as the file says. A point
/// without reading has NaN in x, y and z. The optional arrays are empty or as long as x.
struct CloudData {
  std::vector<float> x, y, z;
  std::vector<float> nx, ny, nz;
  std::vector<float> intensity;
  std::vector<float> curvature;  ///< surface variation, 0…1/3
  std::vector<Rgb8> color;
  std::vector<std::uint32_t> label;
  int width = 0;                              ///< width × height points
  int height = 1;                             ///< above 1: organised as a camera's grid, row by row
  Pose world_from_sensor = Pose::Identity();  ///< where the points were seen from (PCD VIEWPOINT)

  [[nodiscard]] std::size_t size() const noexcept { return x.size(); }
  [[nodiscard]] bool organized() const noexcept { return height > 1; }
  [[nodiscard]] bool has_normals() const noexcept { return !nx.empty(); }
  [[nodiscard]] bool has_intensity() const noexcept { return !intensity.empty(); }
  [[nodiscard]] bool has_curvature() const noexcept { return !curvature.empty(); }
  [[nodiscard]] bool has_color() const noexcept { return !color.empty(); }
};

/// A triangle mesh as a file holds it. `color` is empty or as long as `vertices`.
struct MeshData {
  std::vector<Vec3f> vertices;
  std::vector<Rgb8> color;
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< indices of vertices, all in range
};

}  // namespace grapnel
