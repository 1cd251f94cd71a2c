#include "tests/pipeline/support/surfaces.h"

#include <cmath>

#include "base/math.h"

namespace grapnel::test {

Limits small_limits() {
  Limits limits;
  limits.max_width = 200;
  limits.max_height = 160;
  limits.max_points = 8000;
  limits.max_input_points = 20000;
  limits.max_model_points = 2000;
  limits.max_neighbours = 512;
  return limits;
}

namespace {

void add_point(Surface& surface, const Vec3d& p, const Vec3d& n) {
  const std::size_t i = surface.size++;
  surface.x[i] = static_cast<float>(p.x());
  surface.y[i] = static_cast<float>(p.y());
  surface.z[i] = static_cast<float>(p.z());
  surface.nx[i] = static_cast<float>(n.x());
  surface.ny[i] = static_cast<float>(n.y());
  surface.nz[i] = static_cast<float>(n.z());
}

Vec3d fibonacci(std::size_t i, std::size_t points) {
  const double golden = 2.0 * math::kPi * 0.6180339887498949;
  const double z = 1.0 - (2.0 * static_cast<double>(i) + 1.0) / static_cast<double>(points);
  const double r = std::sqrt(1.0 - z * z);
  const double turn = golden * static_cast<double>(i);
  return {r * std::cos(turn), r * std::sin(turn), z};
}

double sphere_spacing_m(std::size_t points, double radius_m) {
  return radius_m * std::sqrt(4.0 * math::kPi / static_cast<double>(points));
}

Vec3d point_of(const CloudData& cloud, std::size_t i) {
  return Vec3f(cloud.x[i], cloud.y[i], cloud.z[i]).cast<double>();
}

Vec3d normal_of(const CloudData& cloud, std::size_t i) {
  if (!cloud.has_normals()) return Vec3d::Zero();
  return Vec3f(cloud.nx[i], cloud.ny[i], cloud.nz[i]).cast<double>();
}

}  // namespace

OwnedSurface surface_of(const CloudData& cloud) {
  OwnedSurface owned(cloud.size(), 0);
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    if (std::isfinite(cloud.x[i])) add_point(*owned, point_of(cloud, i), normal_of(cloud, i));
  }
  owned->has_viewpoint = true;
  return owned;
}

OwnedSurface grid_surface_of(const CloudData& cloud, const Intrinsics& intrinsics) {
  OwnedSurface owned(cloud.size(), cloud.size());
  owned->grid.width = cloud.width;
  owned->grid.height = cloud.height;
  owned->grid.intrinsics = intrinsics;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    owned->grid.point_of[i] = -1;
    if (!std::isfinite(cloud.x[i])) continue;
    owned->grid.point_of[i] = static_cast<std::int32_t>(owned->size);
    owned->grid.pixel_of[owned->size] = static_cast<std::int32_t>(i);
    add_point(*owned, point_of(cloud, i), normal_of(cloud, i));
  }
  owned->has_viewpoint = true;
  return owned;
}

OwnedSurface random_cloud(std::size_t points, double edge_m, std::uint64_t seed) {
  Rng rng(seed);
  OwnedSurface owned(points, 0);
  for (std::size_t i = 0; i < points; ++i) {
    const double x = rng.uniform(0.0, edge_m);
    const double y = rng.uniform(0.0, edge_m);
    add_point(*owned, {x, y, rng.uniform(0.0, edge_m)}, Vec3d::Zero());
  }
  return owned;
}

OwnedSurface wavy_grid(int width, int height, std::uint64_t seed) {
  Rng rng(seed);
  const auto pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  OwnedSurface owned(pixels, pixels);
  const double focal = 0.9 * width;
  owned->grid.width = width;
  owned->grid.height = height;
  owned->grid.intrinsics = {width, height, focal, focal, 0.5 * (width - 1), 0.5 * (height - 1)};
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      const auto pixel = static_cast<std::size_t>(v * width + u);
      owned->grid.point_of[pixel] = -1;
      if (rng.uniform() < 0.1) continue;
      const double z = 1.0 + 0.05 * std::sin(0.3 * u) * std::cos(0.2 * v) + 0.001 * rng.normal() +
                       (u > width / 2 ? 0.2 : 0.0);
      owned->grid.point_of[pixel] = static_cast<std::int32_t>(owned->size);
      owned->grid.pixel_of[owned->size] = static_cast<std::int32_t>(pixel);
      add_point(*owned,
                {(u - owned->grid.intrinsics.cx) * z / focal,
                 (v - owned->grid.intrinsics.cy) * z / focal, z},
                Vec3d::Zero());
    }
  }
  owned->has_viewpoint = true;
  owned->spacing_m = 1.0 / focal;
  return owned;
}

OwnedSurface sphere(std::size_t points, double radius_m, bool with_normals) {
  OwnedSurface owned(points, 0);
  for (std::size_t i = 0; i < points; ++i) {
    const Vec3d out = fibonacci(i, points);
    add_point(*owned, radius_m * out, with_normals ? out : Vec3d(Vec3d::Zero()));
  }
  owned->spacing_m = sphere_spacing_m(points, radius_m);
  return owned;
}

OwnedSurface bumpy_ball(std::size_t points, double radius_m) {
  OwnedSurface owned(points, 0);
  for (std::size_t i = 0; i < points; ++i) {
    const Vec3d out = fibonacci(i, points);
    const double bump = 1.0 + 0.15 * std::sin(5.0 * out.x() + 1.0) * std::sin(4.0 * out.y()) +
                        0.1 * std::sin(6.0 * out.z() + 0.5);
    add_point(*owned, radius_m * bump * out, Vec3d::Zero());
  }
  owned->spacing_m = sphere_spacing_m(points, radius_m);
  return owned;
}

void move(Surface& surface, const Pose& pose) {
  for (std::size_t i = 0; i < surface.size; ++i) {
    const Vec3f p = (pose * surface.point(i).cast<double>()).cast<float>();
    const Vec3f n = (pose.linear() * surface.normal(i).cast<double>()).cast<float>();
    surface.x[i] = p.x();
    surface.y[i] = p.y();
    surface.z[i] = p.z();
    surface.nx[i] = n.x();
    surface.ny[i] = n.y();
    surface.nz[i] = n.z();
  }
  surface.viewpoint = (pose * surface.viewpoint.cast<double>()).cast<float>();
  surface.grid.width = 0;
  surface.grid.height = 0;
}

TestFrame::TestFrame(int width, int height, double focal_px)
    : counts(static_cast<std::size_t>(width) * static_cast<std::size_t>(height)) {
  frame.depth = {counts.data(), width, height};
  frame.intrinsics = {width, height, focal_px, focal_px, 0.5 * (width - 1), 0.5 * (height - 1)};
}

void TestFrame::draw_plane(const Vec3d& normal, double offset_m, int left, int top, int right,
                           int bottom) {
  const Intrinsics& k = frame.intrinsics;
  for (int v = top; v < bottom; ++v) {
    for (int u = left; u < right; ++u) {
      const Vec3d ray((u - k.cx) / k.fx, (v - k.cy) / k.fy, 1.0);
      const double z = -offset_m / normal.dot(ray);
      at(u, v) = static_cast<std::uint16_t>(z / frame.metres_per_unit + 0.5);
    }
  }
}

}  // namespace grapnel::test
