#include "pipeline/keypoints/range_image.h"

#include <algorithm>
#include <cmath>

namespace grapnel {

namespace {

/// Pixels around the points, so that their borders have something beside them.
constexpr int kMargin = 4;
constexpr double kPitchSpacings = 1.5;
constexpr double kViewRadii = 3.0;

void empty(RangeImage& image) noexcept {
  std::fill_n(image.kind.begin(), image.pixels(), RangeImage::Pixel::Unobserved);
  std::fill_n(image.point.begin(), image.pixels(), -1);
  std::fill_n(image.x.begin(), image.pixels(), RangeImage::kNowhere_m);
  for (std::span<float>* plane : {&image.y, &image.z, &image.range}) {
    std::fill_n(plane->begin(), image.pixels(), 0.0F);
  }
}

void set(RangeImage& image, std::size_t pixel, const Vec3f& p, std::int32_t point) noexcept {
  image.x[pixel] = p.x();
  image.y[pixel] = p.y();
  image.z[pixel] = p.z();
  image.range[pixel] = p.norm();
  image.kind[pixel] = RangeImage::Pixel::Point;
  image.point[pixel] = point;
}

Status see_grid(const Surface& surface, RangeImage& image) noexcept {
  const Surface::Grid& grid = surface.grid;
  int left = grid.width;
  int right = -1;
  int top = grid.height;
  int bottom = -1;
  for (std::size_t i = 0; i < surface.size; ++i) {
    const int u = grid.pixel_of[i] % grid.width;
    const int v = grid.pixel_of[i] / grid.width;
    left = std::min(left, u);
    right = std::max(right, u);
    top = std::min(top, v);
    bottom = std::max(bottom, v);
  }
  left = std::max(0, left - kMargin);
  top = std::max(0, top - kMargin);
  right = std::min(grid.width - 1, right + kMargin);
  bottom = std::min(grid.height - 1, bottom + kMargin);
  image.width = right - left + 1;
  image.height = bottom - top + 1;
  if (image.pixels() > image.x.size()) {
    return Error{Code::CapacityExceeded, Stage::Keypoints,
                 static_cast<std::int32_t>(image.pixels())};
  }
  image.fx = grid.intrinsics.fx;
  image.fy = grid.intrinsics.fy;
  image.cx = grid.intrinsics.cx - left;
  image.cy = grid.intrinsics.cy - top;
  empty(image);
  for (std::size_t i = 0; i < surface.size; ++i) {
    const int u = grid.pixel_of[i] % grid.width - left;
    const int v = grid.pixel_of[i] / grid.width - top;
    set(image, image.at(u, v), surface.point(i), static_cast<std::int32_t>(i));
  }
  return {};
}

/// A camera that looks along `axis`, which is unit.
Mat3d camera_along(const Vec3d& axis) noexcept {
  const Vec3d right = axis.unitOrthogonal();
  const Vec3d down = axis.cross(right);
  Mat3d camera_from_surface;
  camera_from_surface.row(0) = right.transpose();
  camera_from_surface.row(1) = down.transpose();
  camera_from_surface.row(2) = axis.transpose();
  return camera_from_surface;
}

Status see_cloud(const Surface& surface, RangeImage& image) noexcept {
  const Vec3d centre = centroid(surface);
  double radius = 0.0;
  for (std::size_t i = 0; i < surface.size; ++i) {
    radius = std::max(radius, (surface.point(i).cast<double>() - centre).norm());
  }
  if (!(radius < 1e9)) return Error{Code::BadParameter, Stage::Keypoints, 1};
  Vec3d eye = surface.viewpoint.cast<double>();
  if (!surface.has_viewpoint || !((centre - eye).norm() > 1.2 * radius)) {
    eye = centre - Vec3d(0.0, 0.0, kViewRadii * std::max(radius, 1e-6));
  }
  const double away = (centre - eye).norm();
  const Mat3d camera_from_surface = camera_along((centre - eye) / away);
  const auto seen = [&](std::size_t i) {
    return Vec3d(camera_from_surface * (surface.point(i).cast<double>() - eye));
  };
  double half_x = 0.0;
  double half_y = 0.0;
  for (std::size_t i = 0; i < surface.size; ++i) {
    const Vec3d p = seen(i);
    half_x = std::max(half_x, std::fabs(p.x() / p.z()));
    half_y = std::max(half_y, std::fabs(p.y() / p.z()));
  }
  const double spacing = surface.spacing_m > 0.0 ? surface.spacing_m : 0.01 * radius + 1e-6;
  double focal = away / (kPitchSpacings * spacing);
  const auto size_of = [&](double half) {
    return 2.0 * std::floor(focal * half) + 1.0 + 2.0 * kMargin;
  };
  const auto room = static_cast<double>(image.x.size());
  while (size_of(half_x) * size_of(half_y) > room && focal > 1.0) focal *= 0.9;
  if (size_of(half_x) * size_of(half_y) > room) {
    return Error{Code::CapacityExceeded, Stage::Keypoints, static_cast<std::int32_t>(surface.size)};
  }
  image.width = static_cast<int>(size_of(half_x));
  image.height = static_cast<int>(size_of(half_y));
  image.fx = image.fy = focal;
  image.cx = 0.5 * (image.width - 1);
  image.cy = 0.5 * (image.height - 1);
  empty(image);
  for (std::size_t i = 0; i < surface.size; ++i) {
    const Vec3f p = seen(i).cast<float>();
    const Vec3d d = p.cast<double>();
    const int u = static_cast<int>(std::floor(focal * d.x() / d.z() + image.cx + 0.5));
    const int v = static_cast<int>(std::floor(focal * d.y() / d.z() + image.cy + 0.5));
    if (!image.inside(u, v)) continue;
    const std::size_t pixel = image.at(u, v);
    if (image.point[pixel] >= 0 && image.range[pixel] <= p.norm()) continue;
    set(image, pixel, p, static_cast<std::int32_t>(i));
  }
  return {};
}

}  // namespace

void RangeImage::reserve(Arena& arena, std::size_t max_pixels) {
  for (std::span<float>* plane : {&x, &y, &z, &range}) *plane = arena.take<float>(max_pixels);
  kind = arena.take<Pixel>(max_pixels);
  point = arena.take<std::int32_t>(max_pixels);
}

Status see(const Surface& surface, RangeImage& image) noexcept {
  if (surface.size == 0) return Error{Code::TooFewPoints, Stage::Keypoints, 0};
  if (!surface.all_finite()) return Error{Code::BadParameter, Stage::Keypoints, 2};
  const bool grid =
      surface.organised() && surface.grid.intrinsics.fx > 0.0 && surface.grid.intrinsics.fy > 0.0;
  const Status status = grid ? see_grid(surface, image) : see_cloud(surface, image);
  image.resolution_rad = image.fx > 0.0 ? 1.0 / image.fx : 0.0;
  return status;
}

void fill_shadows(RangeImage& image, int max_gap_px) noexcept {
  using Pixel = RangeImage::Pixel;
  for (int v = 0; v < image.height; ++v) {
    int last = -1;
    for (int u = 0; u < image.width; ++u) {
      const std::size_t here = image.at(u, v);
      if (image.kind[here] != Pixel::Point) {
        image.kind[here] = Pixel::Far;
        image.x[here] = RangeImage::kFar_m;
        continue;
      }
      if (last >= 0 && u - last > 1 && u - last - 1 <= max_gap_px) {
        const float z = std::max(image.z[image.at(last, v)], image.z[here]);
        for (int gap = last + 1; gap < u; ++gap) {
          const Vec3d ray((gap - image.cx) / image.fx, (v - image.cy) / image.fy, 1.0);
          const std::size_t pixel = image.at(gap, v);
          set(image, pixel, Vec3f((ray * static_cast<double>(z)).cast<float>()), -1);
          image.kind[pixel] = Pixel::Filled;
        }
      }
      last = u;
    }
  }
}

void halve(const RangeImage& from, RangeImage& to) noexcept {
  to.width = from.width / 2;
  to.height = from.height / 2;
  to.fx = 0.5 * from.fx;
  to.fy = 0.5 * from.fy;
  to.cx = 0.5 * from.cx;
  to.cy = 0.5 * from.cy;
  to.resolution_rad = 2.0 * from.resolution_rad;
  for (int v = 0; v < to.height; ++v) {
    for (int u = 0; u < to.width; ++u) {
      const std::size_t pixel = to.at(u, v);
      to.kind[pixel] = RangeImage::Pixel::Unobserved;
      to.point[pixel] = -1;
      to.x[pixel] = RangeImage::kNowhere_m;
      to.y[pixel] = to.z[pixel] = to.range[pixel] = 0.0F;
      for (const std::size_t other : {from.at(2 * u, 2 * v), from.at(2 * u, 2 * v + 1),
                                      from.at(2 * u + 1, 2 * v), from.at(2 * u + 1, 2 * v + 1)}) {
        if (from.kind[other] == RangeImage::Pixel::Unobserved) continue;
        const bool nearer = to.kind[pixel] < RangeImage::Pixel::Filled ||
                            (from.valid(other) && from.range[other] <= to.range[pixel]);
        if (!nearer) continue;
        to.kind[pixel] = from.kind[other];
        to.point[pixel] = from.point[other];
        to.x[pixel] = from.x[other];
        to.y[pixel] = from.y[other];
        to.z[pixel] = from.z[other];
        to.range[pixel] = from.range[other];
      }
    }
  }
}

}  // namespace grapnel
