#include "pipeline/keypoints/range_image.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "pipeline/kernels/range_levels.h"

namespace grapnel {

namespace {

/// Pixels around the points, so that their borders have something beside them.
constexpr int kMargin = 4;
constexpr double kPitchSpacings = 1.5;
constexpr double kViewRadii = 3.0;

void empty(RangeImage& image, std::size_t begin, std::size_t end) noexcept {
  const std::size_t count = end - begin;
  std::fill_n(&image.kind[begin], count, RangeImage::Pixel::Unobserved);
  std::fill_n(&image.point[begin], count, -1);
  std::fill_n(&image.x[begin], count, RangeImage::kNowhere_m);
  for (const std::span<float>& plane : {image.y, image.z, image.range}) {
    std::fill_n(&plane[begin], count, 0.0F);
  }
}

void empty_rim(RangeImage& image) noexcept {
  empty(image, 0, image.at(0, 0));
  for (int v = 1; v < image.height; ++v) {
    empty(image, image.at(image.width, v - 1), image.at(0, v));
  }
  empty(image, image.at(image.width, image.height - 1), image.pixels());
}

void set(RangeImage& image, std::size_t pixel, const Vec3f& p, std::int32_t point) noexcept {
  image.x[pixel] = p.x();
  image.y[pixel] = p.y();
  image.z[pixel] = p.z();
  image.range[pixel] = p.norm();
  image.kind[pixel] = RangeImage::Pixel::Point;
  image.point[pixel] = point;
}

/// The part of a grid that has points, and a margin about it.
struct Cut {
  int left = 0, right = -1, top = 0, bottom = -1;  ///< inclusive
};
Cut cut_of(const Surface::Grid& grid) noexcept {
  Cut cut{grid.width, -1, grid.height, -1};
  const auto seen = [](std::int32_t point) { return point >= 0; };
  for (int v = 0; v < grid.height; ++v) {
    const auto begin = grid.point_of.begin() + static_cast<std::ptrdiff_t>(v) * grid.width;
    const auto end = begin + grid.width;
    const auto first = std::find_if(begin, end, seen);
    if (first == end) continue;
    const auto behind =
        std::find_if(std::make_reverse_iterator(end), std::make_reverse_iterator(begin), seen);
    cut.left = std::min(cut.left, static_cast<int>(first - begin));
    cut.right = std::max(cut.right, static_cast<int>(behind.base() - begin) - 1);
    cut.top = std::min(cut.top, v);
    cut.bottom = v;
  }
  return {std::max(0, cut.left - kMargin), std::min(grid.width - 1, cut.right + kMargin),
          std::max(0, cut.top - kMargin), std::min(grid.height - 1, cut.bottom + kMargin)};
}

/// All but the ranges.
Status see_grid(const Surface& surface, RangeImage& image) noexcept {
  const Surface::Grid& grid = surface.grid;
  const Cut cut = cut_of(grid);
  image.width = cut.right - cut.left + 1;
  image.height = cut.bottom - cut.top + 1;
  if (image.pixels() > image.kind.size()) {
    return Error{Code::CapacityExceeded, Stage::Keypoints,
                 static_cast<std::int32_t>(image.pixels())};
  }
  image.fx = grid.intrinsics.fx;
  image.fy = grid.intrinsics.fy;
  image.cx = grid.intrinsics.cx - cut.left;
  image.cy = grid.intrinsics.cy - cut.top;
  for (int v = 0; v < image.height; ++v) {
    const std::int32_t* const points =
        &grid.point_of[static_cast<std::size_t>((v + cut.top) * grid.width + cut.left)];
    const std::size_t row = image.at(0, v);
    for (std::size_t u = 0; u < static_cast<std::size_t>(image.width); ++u) {
      const std::int32_t point = points[u];
      const bool seen = point >= 0;
      const auto i = static_cast<std::size_t>(seen ? point : 0);
      image.x[row + u] = seen ? surface.x[i] : RangeImage::kNowhere_m;
      image.y[row + u] = seen ? surface.y[i] : 0.0F;
      image.z[row + u] = seen ? surface.z[i] : 0.0F;
      image.kind[row + u] = seen ? RangeImage::Pixel::Point : RangeImage::Pixel::Unobserved;
      image.point[row + u] = point;
    }
  }
  empty_rim(image);
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
  const auto fits = [&] {
    return (size_of(half_x) + 2.0 * RangeImage::kRim) *
               (size_of(half_y) + 2.0 * RangeImage::kRim) <=
           static_cast<double>(image.kind.size());
  };
  while (!fits() && focal > 1.0) focal *= 0.9;
  if (!fits()) {
    return Error{Code::CapacityExceeded, Stage::Keypoints, static_cast<std::int32_t>(surface.size)};
  }
  image.width = static_cast<int>(size_of(half_x));
  image.height = static_cast<int>(size_of(half_y));
  image.fx = image.fy = focal;
  image.cx = 0.5 * (image.width - 1);
  image.cy = 0.5 * (image.height - 1);
  empty(image, 0, image.pixels());
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
  // Windows and rows are read and written in whole blocks.
  const std::size_t padded = max_pixels + 2 * kernels::kRangeBlock;
  for (std::span<float>* plane : {&x, &y, &z, &range}) *plane = arena.take<float>(padded);
  kind = arena.take<Pixel>(max_pixels);
  point = arena.take<std::int32_t>(padded);
}

Status see(const Surface& surface, RangeImage& image) noexcept {
  if (surface.size == 0) return Error{Code::TooFewPoints, Stage::Keypoints, 0};
  if (!surface.all_finite()) return Error{Code::BadParameter, Stage::Keypoints, 2};
  const bool grid =
      surface.organised() && surface.grid.intrinsics.fx > 0.0 && surface.grid.intrinsics.fy > 0.0;
  const Status status = grid ? see_grid(surface, image) : see_cloud(surface, image);
  image.resolution_rad = image.fx > 0.0 ? 1.0 / image.fx : 0.0;
  if (!status.ok()) return status;
  image.nearest_m = RangeImage::kNowhere_m;
  image.farthest_m = 0.0F;
  kernels::ranges({image.x.data(), image.y.data(), image.z.data(), image.stride()},
                  static_cast<std::ptrdiff_t>(image.pixels()), image.range.data(), &image.nearest_m,
                  &image.farthest_m);
  return status;
}

void fill_shadows(RangeImage& image, int max_gap_px) noexcept {
  using Pixel = RangeImage::Pixel;
  constexpr int kAtOnce = 8;
  for (int v = 0; v < image.height; ++v) {
    int last = -1;
    for (int u = 0; u < image.width; ++u) {
      const std::size_t here = image.at(u, v);
      if (last == u - 1 && u + kAtOnce <= image.width) {
        const Pixel* const kinds = &image.kind[here];
        if (std::all_of(kinds, kinds + kAtOnce, [](Pixel k) { return k == Pixel::Point; })) {
          u += kAtOnce - 1;
          last = u;
          continue;
        }
      }
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
  GRAPNEL_ASSERT(to.pixels() <= to.kind.size());
  for (int v = 0; v < to.height; ++v) {
    const std::size_t in = from.at(0, 2 * v);
    const std::size_t out = to.at(0, v);
    kernels::halve_row({&from.x[in], &from.y[in], &from.z[in], &from.range[in], &from.point[in]},
                       from.stride(), to.width,
                       {&to.x[out], &to.y[out], &to.z[out], &to.range[out], &to.point[out]});
  }
  empty_rim(to);
  using Pixel = RangeImage::Pixel;
  for (std::size_t pixel = 0; pixel < to.pixels(); ++pixel) {
    const Pixel missing =
        to.x[pixel] > 1.5F * RangeImage::kNowhere_m ? Pixel::Far : Pixel::Unobserved;
    const Pixel seen = to.point[pixel] >= 0 ? Pixel::Point : Pixel::Filled;
    to.kind[pixel] = to.x[pixel] < RangeImage::kNowhere_m ? seen : missing;
  }
}

RangeImage rows_of(const RangeImage& image, int top, int bottom) noexcept {
  RangeImage part = image;
  const std::size_t begin = image.at(-RangeImage::kRim, top - RangeImage::kRim);
  part.height = bottom - top;
  part.cy -= top;
  for (std::span<float>* plane : {&part.x, &part.y, &part.z, &part.range}) {
    *plane = plane->subspan(begin);
  }
  part.kind = part.kind.subspan(begin);
  part.point = part.point.subspan(begin);
  return part;
}

}  // namespace grapnel
