#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/geometry.h"

namespace grapnel {

/// A triangle mesh in its own frame, metres. Seen from outside, corners run counter-clockwise, so
/// that normals point outward.
struct Mesh {
  using Triangle = std::array<std::uint32_t, 3>;

  std::vector<Vec3d> vertices;
  std::vector<Triangle> triangles;

  std::uint32_t add_vertex(const Vec3d& vertex);
  void add_triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c);
  /// Corners in counter-clockwise order from outside; split along a-c.
  void add_quad(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d);
};

/// Opposite corners of the axis-aligned box around the vertices; both zero for an empty mesh.
struct Bounds {
  Vec3d low_m = Vec3d::Zero();
  Vec3d high_m = Vec3d::Zero();
  [[nodiscard]] Vec3d size_m() const { return high_m - low_m; }
  [[nodiscard]] Vec3d centre_m() const { return 0.5 * (low_m + high_m); }
};

[[nodiscard]] Bounds bounds_of(const Mesh& mesh);
/// Unit outward normal of one triangle, zero for one without area.
[[nodiscard]] Vec3d triangle_normal(const Mesh& mesh, std::size_t triangle_i);
[[nodiscard]] double triangle_area_m2(const Mesh& mesh, std::size_t triangle_i);
[[nodiscard]] double surface_area_m2(const Mesh& mesh);
/// Volume by the divergence theorem: that of the solid when the mesh is closed and its normals
/// point outward.
[[nodiscard]] double enclosed_volume_m3(const Mesh& mesh);
/// Moves the centre of the bounds to the origin.
void centre(Mesh& mesh);
/// Lowest z of the vertices after the rotation: what rests on the belt.
[[nodiscard]] double lowest_z_m(const Mesh& mesh, const Mat3d& rotation);

/// Points of a surface with their outward unit normals.
struct SurfaceSamples {
  std::vector<Vec3d> points_m;
  std::vector<Vec3d> normals;
};

/// Evenly spread points on the mesh: random candidates, weighted by area, of which none is kept
/// nearer than `spacing_m` to one kept before (dart throwing, Cook 1986). The same seed gives the
/// same points. O(area / spacing²).
[[nodiscard]] SurfaceSamples sample_surface(const Mesh& mesh, double spacing_m, std::uint64_t seed);

}  // namespace grapnel
