#include "drivers/synthetic/mesh.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/assert.h"
#include "base/rng.h"

namespace grapnel {
namespace {

// Candidates per kept point. Dart throwing is within a few per cent of its densest packing by then.
constexpr double kCandidatesPerPoint = 20.0;

Vec3d area_vector(const Mesh& mesh, std::size_t triangle_i) {
  const Mesh::Triangle& corner = mesh.triangles[triangle_i];
  const Vec3d& a = mesh.vertices[corner[0]];
  return 0.5 * (mesh.vertices[corner[1]] - a).cross(mesh.vertices[corner[2]] - a);
}

/// Buckets of kept points in cells as wide as the spacing: every conflict lies in the 27 cells
/// around a candidate.
class DartBoard {
 public:
  DartBoard(const Bounds& bounds, double spacing_m) : low_m_(bounds.low_m), spacing_m_(spacing_m) {
    for (int axis = 0; axis < 3; ++axis) {
      cells_[axis] = static_cast<std::int64_t>(bounds.size_m()[axis] / spacing_m) + 1;
    }
    first_.assign(static_cast<std::size_t>(cells_[0] * cells_[1] * cells_[2]), kNone);
  }

  bool keep(const Vec3d& point, SurfaceSamples& samples) {
    std::int64_t cell[3];
    for (int axis = 0; axis < 3; ++axis) {
      const auto index = static_cast<std::int64_t>((point[axis] - low_m_[axis]) / spacing_m_);
      cell[axis] = std::clamp<std::int64_t>(index, 0, cells_[axis] - 1);
    }
    if (conflicts(point, cell, samples)) return false;
    std::uint32_t& first = first_[slot(cell[0], cell[1], cell[2])];
    next_.push_back(first);
    first = static_cast<std::uint32_t>(samples.points_m.size());
    return true;
  }

 private:
  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

  [[nodiscard]] std::size_t slot(std::int64_t x, std::int64_t y, std::int64_t z) const {
    return static_cast<std::size_t>((z * cells_[1] + y) * cells_[0] + x);
  }

  [[nodiscard]] bool conflicts(const Vec3d& point, const std::int64_t* cell,
                               const SurfaceSamples& samples) const {
    for (std::int64_t z = std::max<std::int64_t>(cell[2] - 1, 0);
         z <= std::min(cell[2] + 1, cells_[2] - 1); ++z) {
      for (std::int64_t y = std::max<std::int64_t>(cell[1] - 1, 0);
           y <= std::min(cell[1] + 1, cells_[1] - 1); ++y) {
        for (std::int64_t x = std::max<std::int64_t>(cell[0] - 1, 0);
             x <= std::min(cell[0] + 1, cells_[0] - 1); ++x) {
          for (std::uint32_t i = first_[slot(x, y, z)]; i != kNone; i = next_[i]) {
            if ((samples.points_m[i] - point).squaredNorm() < spacing_m_ * spacing_m_) return true;
          }
        }
      }
    }
    return false;
  }

  Vec3d low_m_;
  double spacing_m_;
  std::int64_t cells_[3]{};
  std::vector<std::uint32_t> first_;
  std::vector<std::uint32_t> next_;
};

}  // namespace

std::uint32_t Mesh::add_vertex(const Vec3d& vertex) {
  vertices.push_back(vertex);
  return static_cast<std::uint32_t>(vertices.size() - 1);
}

void Mesh::add_triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
  triangles.push_back({a, b, c});
}

void Mesh::add_quad(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
  add_triangle(a, b, c);
  add_triangle(a, c, d);
}

Bounds bounds_of(const Mesh& mesh) {
  if (mesh.vertices.empty()) return {};
  Bounds bounds{mesh.vertices.front(), mesh.vertices.front()};
  for (const Vec3d& vertex : mesh.vertices) {
    bounds.low_m = bounds.low_m.cwiseMin(vertex);
    bounds.high_m = bounds.high_m.cwiseMax(vertex);
  }
  return bounds;
}

Vec3d triangle_normal(const Mesh& mesh, std::size_t triangle_i) {
  const Vec3d area = area_vector(mesh, triangle_i);
  const double length = std::sqrt(area.squaredNorm());
  return length > 0.0 ? Vec3d(area / length) : Vec3d::Zero();
}

double triangle_area_m2(const Mesh& mesh, std::size_t triangle_i) {
  return std::sqrt(area_vector(mesh, triangle_i).squaredNorm());
}

double surface_area_m2(const Mesh& mesh) {
  double sum = 0.0;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) sum += triangle_area_m2(mesh, i);
  return sum;
}

double enclosed_volume_m3(const Mesh& mesh) {
  double sum = 0.0;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    sum += mesh.vertices[mesh.triangles[i][0]].dot(area_vector(mesh, i)) / 3.0;
  }
  return sum;
}

void centre(Mesh& mesh) {
  const Vec3d middle = bounds_of(mesh).centre_m();
  for (Vec3d& vertex : mesh.vertices) vertex -= middle;
}

double lowest_z_m(const Mesh& mesh, const Mat3d& rotation) {
  double lowest = std::numeric_limits<double>::infinity();
  for (const Vec3d& vertex : mesh.vertices) lowest = std::min(lowest, (rotation * vertex).z());
  return lowest;
}

SurfaceSamples sample_surface(const Mesh& mesh, double spacing_m, std::uint64_t seed) {
  GRAPNEL_ASSERT(spacing_m > 0.0);
  SurfaceSamples samples;
  if (mesh.triangles.empty()) return samples;
  std::vector<double> area_up_to_m2;
  double area_m2 = 0.0;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    area_m2 += triangle_area_m2(mesh, i);
    area_up_to_m2.push_back(area_m2);
  }
  Rng rng(seed);
  DartBoard board(bounds_of(mesh), spacing_m);
  const auto candidates =
      static_cast<std::size_t>(kCandidatesPerPoint * area_m2 / (spacing_m * spacing_m)) + 1;
  for (std::size_t i = 0; i < candidates; ++i) {
    const auto found =
        std::upper_bound(area_up_to_m2.begin(), area_up_to_m2.end(), rng.uniform() * area_m2);
    const std::size_t triangle_i =
        std::min(static_cast<std::size_t>(found - area_up_to_m2.begin()), area_up_to_m2.size() - 1);
    double s = rng.uniform();
    double t = rng.uniform();
    if (s + t > 1.0) {
      s = 1.0 - s;
      t = 1.0 - t;
    }
    const Mesh::Triangle& corner = mesh.triangles[triangle_i];
    const Vec3d& a = mesh.vertices[corner[0]];
    const Vec3d point = a + s * (mesh.vertices[corner[1]] - a) + t * (mesh.vertices[corner[2]] - a);
    if (!board.keep(point, samples)) continue;
    samples.points_m.push_back(point);
    samples.normals.push_back(triangle_normal(mesh, triangle_i));
  }
  return samples;
}

}  // namespace grapnel
