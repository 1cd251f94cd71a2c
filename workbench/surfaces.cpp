#include "workbench/surfaces.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <new>

#include "base/arena.h"

namespace grapnel {
namespace {

float luminance(const Rgb8& color) {
  // ITU-R BT.601.
  return (0.299F * color.r + 0.587F * color.g + 0.114F * color.b) / 255.0F;
}

/// Least squares of pixel = focal · ratio + centre.
struct LineFit {
  double n = 0.0, sum_x = 0.0, sum_y = 0.0, sum_xx = 0.0, sum_xy = 0.0, sum_yy = 0.0;

  void add(double x, double y) {
    n += 1.0;
    sum_x += x;
    sum_y += y;
    sum_xx += x * x;
    sum_xy += x * y;
    sum_yy += y * y;
  }
  [[nodiscard]] double slope() const {
    const double spread = sum_xx - sum_x * sum_x / n;
    return spread > 0.0 ? (sum_xy - sum_x * sum_y / n) / spread : 0.0;
  }
  [[nodiscard]] double offset() const { return (sum_y - slope() * sum_x) / n; }
  /// Root mean square of what the line leaves.
  [[nodiscard]] double residual() const {
    const double spread_y = sum_yy - sum_y * sum_y / n;
    const double spread_xy = sum_xy - sum_x * sum_y / n;
    return std::sqrt(std::max(0.0, spread_y - slope() * spread_xy) / n);
  }
};

bool finite(const CloudData& cloud, std::size_t i) {
  return std::isfinite(cloud.x[i]) && std::isfinite(cloud.y[i]) && std::isfinite(cloud.z[i]);
}

void push_point(Surface& surface, const Vec3f& point) {
  const std::size_t i = surface.size++;
  surface.x[i] = point.x();
  surface.y[i] = point.y();
  surface.z[i] = point.z();
  surface.nx[i] = surface.ny[i] = surface.nz[i] = 0.0F;
  surface.intensity[i] = 0.0F;
}

void set_grid(Surface& surface, const Intrinsics& intrinsics) {
  surface.grid.width = intrinsics.width;
  surface.grid.height = intrinsics.height;
  surface.grid.intrinsics = intrinsics;
  surface.viewpoint = Vec3f::Zero();
  surface.has_viewpoint = true;
}

/// Whether the points lie before a camera at the origin that looks along +z, as those of a fused
/// run of frames in its first camera's coordinates: all within 60 degrees of the axis, and none
/// nearer than a tenth of the farthest. A cloud that is modelled about its own origin does not.
bool lies_before_camera(const CloudData& cloud) {
  constexpr float kTangent = 1.7320508F;
  constexpr float kNearest = 0.1F;
  float nearest_m = std::numeric_limits<float>::max();
  float farthest_m = 0.0F;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    if (!finite(cloud, i)) continue;
    if (!(std::hypot(cloud.x[i], cloud.y[i]) < kTangent * cloud.z[i])) return false;
    nearest_m = std::min(nearest_m, cloud.z[i]);
    farthest_m = std::max(farthest_m, cloud.z[i]);
  }
  return farthest_m > 0.0F && nearest_m > kNearest * farthest_m;
}

/// Of a cloud without grid: what the file names, or the origin where it can have been a camera's.
void set_viewpoint(const CloudData& cloud, Surface& surface) {
  const Vec3d named = cloud.world_from_sensor.translation();
  surface.has_viewpoint = !named.isZero() || lies_before_camera(cloud);
  if (surface.has_viewpoint) surface.viewpoint = named.cast<float>();
}

void copy_attributes(const CloudData& cloud, std::size_t from, Surface& surface, std::size_t to) {
  if (cloud.has_normals()) {
    const Vec3f normal(cloud.nx[from], cloud.ny[from], cloud.nz[from]);
    const float length = normal.norm();
    if (std::isfinite(length) && length > 0.0F) {
      surface.nx[to] = normal.x() / length;
      surface.ny[to] = normal.y() / length;
      surface.nz[to] = normal.z() / length;
    }
  }
  if (cloud.has_color()) {
    surface.intensity[to] = luminance(cloud.color[from]);
  } else if (cloud.has_intensity() && std::isfinite(cloud.intensity[from])) {
    surface.intensity[to] = std::min(1.0F, std::max(0.0F, cloud.intensity[from]));
  }
}

}  // namespace

void StoredSurface::Free::operator()(std::byte* block) const noexcept {
  ::operator delete[](block, std::align_val_t{Arena::kAlignment});
}

StoredSurface::StoredSurface(std::size_t max_points, std::size_t max_grid_pixels) {
  Arena measure;
  surface.reserve(measure, max_points, max_grid_pixels);
  const std::size_t bytes = measure.used_bytes() + Arena::kAlignment;
  block_.reset(new (std::align_val_t{Arena::kAlignment}) std::byte[bytes]);
  Arena carve({block_.get(), bytes});
  surface.reserve(carve, max_points, max_grid_pixels);
  surface.clear();
}

Intrinsics fit_intrinsics(const CloudData& cloud) {
  // Half a pixel: a grid that is a camera's own misses its rays by rounding only, a rectified or
  // resampled one by pixels.
  constexpr double kMaxResidual_px = 0.5;
  constexpr double kMinPoints = 100.0;
  if (!cloud.organized()) return {};
  LineFit columns;
  LineFit rows;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    if (!finite(cloud, i) || !(cloud.z[i] > 0.0F)) continue;
    const double z = static_cast<double>(cloud.z[i]);
    const auto width = static_cast<std::size_t>(cloud.width);
    columns.add(static_cast<double>(cloud.x[i]) / z, static_cast<double>(i % width));
    rows.add(static_cast<double>(cloud.y[i]) / z, static_cast<double>(i / width));
  }
  if (columns.n < kMinPoints) return {};
  const Intrinsics fitted = {cloud.width,  cloud.height,     columns.slope(),
                             rows.slope(), columns.offset(), rows.offset()};
  const bool camera =
      fitted.valid() && columns.residual() <= kMaxResidual_px && rows.residual() <= kMaxResidual_px;
  return camera ? fitted : Intrinsics{};
}

std::unique_ptr<StoredSurface> make_surface(const DepthFrame& frame) {
  const std::size_t pixels = frame.depth.pixels();
  auto stored = std::make_unique<StoredSurface>(pixels, pixels);
  Surface& surface = stored->surface;
  set_grid(surface, frame.intrinsics);
  std::size_t pixel = 0;
  for (int v = 0; v < frame.depth.height; ++v) {
    for (int u = 0; u < frame.depth.width; ++u, ++pixel) {
      surface.grid.point_of[pixel] = -1;
      if (frame.depth.at(u, v) == 0) continue;
      const std::size_t i = surface.size;
      push_point(surface, point_of_pixel(frame, u, v));
      stored->input_of.push_back(static_cast<std::uint32_t>(pixel));
      if (!frame.color.empty()) surface.intensity[i] = luminance(frame.color.at(u, v));
      surface.grid.point_of[pixel] = static_cast<std::int32_t>(i);
      surface.grid.pixel_of[i] = static_cast<std::int32_t>(pixel);
    }
  }
  return stored;
}

std::unique_ptr<StoredSurface> make_surface(const CloudData& cloud) {
  const Intrinsics intrinsics = fit_intrinsics(cloud);
  const std::size_t pixels = intrinsics.valid() ? cloud.size() : 0;
  auto stored = std::make_unique<StoredSurface>(cloud.size(), pixels);
  Surface& surface = stored->surface;
  if (intrinsics.valid()) {
    set_grid(surface, intrinsics);
  } else {
    set_viewpoint(cloud, surface);
  }
  for (std::size_t from = 0; from < cloud.size(); ++from) {
    if (pixels > 0) surface.grid.point_of[from] = -1;
    if (!finite(cloud, from)) continue;
    const std::size_t to = surface.size;
    push_point(surface, {cloud.x[from], cloud.y[from], cloud.z[from]});
    copy_attributes(cloud, from, surface, to);
    stored->input_of.push_back(static_cast<std::uint32_t>(from));
    if (pixels == 0) continue;
    surface.grid.point_of[from] = static_cast<std::int32_t>(to);
    surface.grid.pixel_of[to] = static_cast<std::int32_t>(from);
  }
  return stored;
}

std::unique_ptr<StoredSurface> make_surface(const Input& input) {
  return input.is_frame() ? make_surface(input.frame()) : make_surface(input.cloud());
}

double measured_spacing_m(const Surface& surface) {
  constexpr std::size_t kSamples = 200;
  if (surface.size < 2) return 0.0;
  if (surface.organised()) {
    std::vector<float> z(surface.z.begin(),
                         surface.z.begin() + static_cast<std::ptrdiff_t>(surface.size));
    const auto middle = z.begin() + static_cast<std::ptrdiff_t>(z.size() / 2);
    std::nth_element(z.begin(), middle, z.end());
    return static_cast<double>(*middle) / surface.grid.intrinsics.fx;
  }
  const std::size_t step = std::max<std::size_t>(1, surface.size / kSamples);
  double sum_m = 0.0;
  std::size_t count = 0;
  for (std::size_t i = 0; i < surface.size; i += step) {
    float nearest_m2 = std::numeric_limits<float>::max();
    for (std::size_t j = 0; j < surface.size; ++j) {
      const float square_m2 = (surface.point(j) - surface.point(i)).squaredNorm();
      if (j != i && square_m2 < nearest_m2) nearest_m2 = square_m2;
    }
    sum_m += std::sqrt(static_cast<double>(nearest_m2));
    ++count;
  }
  return sum_m / static_cast<double>(count);
}

}  // namespace grapnel
