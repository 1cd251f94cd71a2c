#include "drivers/synthetic/rasterizer.h"

#include <algorithm>
#include <cmath>

#include "base/assert.h"

namespace grapnel {
namespace {

// A pixel centre this far outside an edge (in px² of the edge function) still counts as inside, so
// that rounding opens no crack between neighbours.
constexpr double kEdgeSlack = 1e-7;

}  // namespace

/// A triangle in the image: three edge functions that are not negative inside, and the plane's
/// 1/z as an affine function of the pixel.
struct Rasterizer::Setup {
  int first_u, last_u, first_v, last_v;
  double edge_u[3], edge_v[3], edge_1[3];
  double inverse_u, inverse_v, inverse_1;
  double inverse_min, inverse_max;
};

Rasterizer::Rasterizer(const Intrinsics& intrinsics) : intrinsics_(intrinsics) {
  GRAPNEL_ASSERT(intrinsics.valid());
  const std::size_t pixels =
      static_cast<std::size_t>(intrinsics.width) * static_cast<std::size_t>(intrinsics.height);
  inverse_depth_.assign(pixels, 0.0f);
  face_.assign(pixels, kNoFace);
  covered_by_.assign(pixels, 0);
}

void Rasterizer::clear() {
  std::fill(inverse_depth_.begin(), inverse_depth_.end(), 0.0f);
  std::fill(face_.begin(), face_.end(), kNoFace);
}

Rasterizer::Outline Rasterizer::draw(const Mesh& mesh, const Pose& camera_from_model,
                                     std::int32_t first_face) {
  ++draws_;
  Outline outline;
  outline.inside = project(mesh, camera_from_model);
  Setup setup{};
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    if (set_up(mesh.triangles[i], setup)) {
      outline.pixels += fill(setup, first_face + static_cast<std::int32_t>(i));
    }
  }
  return outline;
}

bool Rasterizer::project(const Mesh& mesh, const Pose& camera_from_model) {
  points_m_.resize(mesh.vertices.size());
  corners_.resize(mesh.vertices.size());
  bool inside = true;
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    const Vec3d point = camera_from_model * mesh.vertices[i];
    points_m_[i] = point;
    corners_[i] = {};
    if (point.z() < kNear_m) {
      inside = false;
      continue;
    }
    const double inverse_z = 1.0 / point.z();
    const double u = intrinsics_.fx * point.x() * inverse_z + intrinsics_.cx;
    const double v = intrinsics_.fy * point.y() * inverse_z + intrinsics_.cy;
    inside =
        inside && u >= 0.0 && v >= 0.0 && u <= intrinsics_.width - 1 && v <= intrinsics_.height - 1;
    corners_[i] = {u, v, inverse_z};
  }
  return inside;
}

bool Rasterizer::set_up(const Mesh::Triangle& triangle, Setup& setup) const {
  const Corner* corner[3];
  for (std::size_t i = 0; i < 3; ++i) {
    corner[i] = &corners_[triangle[i]];
    if (corner[i]->inverse_z == 0.0) return false;
  }
  const Vec3d& a = points_m_[triangle[0]];
  const Vec3d normal = (points_m_[triangle[1]] - a).cross(points_m_[triangle[2]] - a);
  const double offset = normal.dot(a);
  if (offset >= 0.0) return false;  // seen from behind or edge-on

  const auto [low_u, high_u] = std::minmax({corner[0]->u, corner[1]->u, corner[2]->u});
  const auto [low_v, high_v] = std::minmax({corner[0]->v, corner[1]->v, corner[2]->v});
  if (high_u < 0.0 || high_v < 0.0 || low_u > intrinsics_.width - 1 ||
      low_v > intrinsics_.height - 1) {
    return false;
  }
  setup.first_u = static_cast<int>(std::ceil(std::max(low_u, 0.0)));
  setup.first_v = static_cast<int>(std::ceil(std::max(low_v, 0.0)));
  setup.last_u = static_cast<int>(std::min(high_u, static_cast<double>(intrinsics_.width - 1)));
  setup.last_v = static_cast<int>(std::min(high_v, static_cast<double>(intrinsics_.height - 1)));

  // A triangle that faces the camera runs counter-clockwise as seen, so with v down the negative
  // sense of u × v; the edge functions carry the sign that makes the inside positive.
  for (int i = 0; i < 3; ++i) {
    const Corner& from = *corner[i];
    const Corner& to = *corner[(i + 1) % 3];
    setup.edge_u[i] = to.v - from.v;
    setup.edge_v[i] = from.u - to.u;
    setup.edge_1[i] = -(setup.edge_u[i] * from.u + setup.edge_v[i] * from.v);
  }
  setup.inverse_u = normal.x() / (intrinsics_.fx * offset);
  setup.inverse_v = normal.y() / (intrinsics_.fy * offset);
  setup.inverse_1 =
      normal.z() / offset - setup.inverse_u * intrinsics_.cx - setup.inverse_v * intrinsics_.cy;
  const auto [low, high] =
      std::minmax({corner[0]->inverse_z, corner[1]->inverse_z, corner[2]->inverse_z});
  setup.inverse_min = low;
  setup.inverse_max = high;
  return true;
}

std::size_t Rasterizer::fill(const Setup& setup, std::int32_t face) {
  std::size_t covered = 0;
  for (int v = setup.first_v; v <= setup.last_v; ++v) {
    const std::size_t row =
        static_cast<std::size_t>(v) * static_cast<std::size_t>(intrinsics_.width);
    double at_row[3];
    for (int i = 0; i < 3; ++i) at_row[i] = setup.edge_v[i] * v + setup.edge_1[i];
    const double inverse_row = setup.inverse_v * v + setup.inverse_1;
    for (int u = setup.first_u; u <= setup.last_u; ++u) {
      if (setup.edge_u[0] * u + at_row[0] < -kEdgeSlack) continue;
      if (setup.edge_u[1] * u + at_row[1] < -kEdgeSlack) continue;
      if (setup.edge_u[2] * u + at_row[2] < -kEdgeSlack) continue;
      const std::size_t pixel = row + static_cast<std::size_t>(u);
      if (covered_by_[pixel] != draws_) {
        covered_by_[pixel] = draws_;
        ++covered;
      }
      // On a sliver the plane is steep; no pixel of it lies outside its corners' depths.
      const auto inverse_z = static_cast<float>(
          std::clamp(setup.inverse_u * u + inverse_row, setup.inverse_min, setup.inverse_max));
      if (inverse_z > inverse_depth_[pixel]) {
        inverse_depth_[pixel] = inverse_z;
        face_[pixel] = face;
      }
    }
  }
  return covered;
}

}  // namespace grapnel
