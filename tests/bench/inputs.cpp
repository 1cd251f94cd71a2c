#include "tests/bench/inputs.h"

#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "base/math.h"
#include "base/rng.h"
#include "pipeline/preprocess/normals.h"

namespace grapnel::bench {
namespace {

void estimate_normals(Surface& surface) {
  PcaNormals normals({});
  const test::ArenaMemory memory([&](Arena& arena) { normals.reserve(arena, large()); });
  require(normals.estimate(surface).ok(), "normals");
}

void add_point(Surface& s, int u, int v) {
  const auto pixel = static_cast<std::size_t>(v * s.grid.width + u);
  const double across = static_cast<double>(u) / s.grid.width;
  const double down = static_cast<double>(v) / s.grid.width;
  const bool on_part = across > 0.3 && across < 0.7 && down > 0.2 && down < 0.55;
  const double z = 1.0 + 0.1 * down + 0.02 * math::sin(60.0 * across) * math::cos(50.0 * down) -
                   (on_part ? 0.15 : 0.0);
  const std::size_t i = s.size++;
  s.grid.point_of[pixel] = static_cast<std::int32_t>(i);
  s.grid.pixel_of[i] = static_cast<std::int32_t>(pixel);
  s.x[i] = static_cast<float>((u - s.grid.intrinsics.cx) * z / s.grid.intrinsics.fx);
  s.y[i] = static_cast<float>((v - s.grid.intrinsics.cy) * z / s.grid.intrinsics.fy);
  s.z[i] = static_cast<float>(z);
  s.intensity[i] =
      static_cast<float>(0.5 + 0.25 * math::sin(90.0 * across) + 0.25 * math::cos(130.0 * down));
}

}  // namespace

test::TestFrame make_frame() {
  test::TestFrame frame(kWidth, kHeight, kFocal_px);
  frame.draw_plane(Vec3d(0.0, -0.5, -1.0).normalized(), 1.0, 0, 0, kWidth, kHeight);
  Rng rng(1);
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      std::uint16_t& count = frame.at(u, v);
      const double z_m = 0.001 * count;
      double part = 0.0;
      if (u >= 200 && u < 440 && v >= 120 && v < 360) {
        part = 60.0 + 25.0 * std::sin(0.07 * u) * std::cos(0.05 * v + 0.02 * u);
      }
      const double noise = 1.425 * z_m * z_m * rng.normal();
      count = rng.uniform() < 0.003 ? std::uint16_t{0}
                                    : static_cast<std::uint16_t>(count - part + noise + 0.5);
    }
  }
  return frame;
}

void fill(const test::TestFrame& frame, int stride, Surface& surface) {
  surface.clear();
  surface.grid.width = kWidth / stride;
  surface.grid.height = kHeight / stride;
  surface.grid.intrinsics = frame.frame.intrinsics;
  Intrinsics& grid = surface.grid.intrinsics;
  grid.width = surface.grid.width;
  grid.height = surface.grid.height;
  grid.fx /= stride;
  grid.fy /= stride;
  grid.cx /= stride;
  grid.cy /= stride;
  surface.has_viewpoint = true;
  surface.viewpoint = Vec3f::Zero();
  surface.spacing_m = 0.0019 * stride;
  std::size_t pixel = 0;
  for (int v = 0; v < grid.height; ++v) {
    for (int u = 0; u < grid.width; ++u, ++pixel) {
      const std::uint16_t count = frame.frame.depth.at(u * stride, v * stride);
      surface.grid.point_of[pixel] = -1;
      if (count == 0) continue;
      const std::size_t i = surface.size++;
      const double z = 0.001 * count;
      surface.x[i] = static_cast<float>(z * (u - grid.cx) / grid.fx);
      surface.y[i] = static_cast<float>(z * (v - grid.cy) / grid.fy);
      surface.z[i] = static_cast<float>(z);
      surface.nx[i] = surface.ny[i] = surface.nz[i] = surface.intensity[i] = 0.0F;
      surface.grid.pixel_of[i] = static_cast<std::int32_t>(pixel);
      surface.grid.point_of[pixel] = static_cast<std::int32_t>(i);
    }
  }
}

test::OwnedSurface make_view(int width, bool on_grid) {
  const int height = width * 3 / 4;
  const auto pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  test::OwnedSurface owned(pixels, pixels);
  Surface& s = *owned;
  const double focal = 0.9 * width;
  s.grid.width = width;
  s.grid.height = height;
  s.grid.intrinsics = {width, height, focal, focal, 0.5 * (width - 1), 0.5 * (height - 1)};
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) add_point(s, u, v);
  }
  s.has_viewpoint = true;
  s.spacing_m = 1.0 / focal;
  estimate_normals(s);
  if (!on_grid) s.grid.width = s.grid.height = 0;
  return owned;
}

test::OwnedSurface make_ball(std::size_t points) {
  test::OwnedSurface ball = test::bumpy_ball(points, 0.2);
  estimate_normals(*ball);
  return ball;
}

void require(bool ok, const char* what) {
  if (ok) return;
  std::fprintf(stderr, "%s failed\n", what);
  std::exit(1);
}

Limits large() {
  Limits limits;
  limits.max_points = limits.max_input_points = limits.max_model_points = kPixels;
  limits.max_keypoints = kPixels / 8;
  return limits;
}

}  // namespace grapnel::bench
