#include "workbench/import/cloud_grid.h"

#include <cmath>
#include <cstddef>

namespace grapnel {
namespace {

constexpr std::size_t kMinPoints = 100;
constexpr double kMaxResidual_px = 0.5;
// A float at 10 m has steps of a millionth of a metre.
constexpr double kWhole_mm = 2e-3;
constexpr double kMillimetre_m = 0.001;
constexpr double kTumUnit_m = 0.0002;

/// Least squares of a line value = slope × at + offset.
class LineFit {
 public:
  void add(double at, double value) noexcept {
    count_ += 1.0;
    at_ += at;
    value_ += value;
    square_ += at * at;
    product_ += at * value;
  }
  [[nodiscard]] double slope() const noexcept {
    return (count_ * product_ - at_ * value_) / (count_ * square_ - at_ * at_);
  }
  [[nodiscard]] double offset() const noexcept { return (value_ - slope() * at_) / count_; }

 private:
  double count_ = 0.0, at_ = 0.0, value_ = 0.0, square_ = 0.0, product_ = 0.0;
};

/// Runs `use(u, v, x/|z|, y/|z|)` on every point of the grid, turned to look along +z.
template <class Use>
void for_each_ray(const CloudData& cloud, Use use) {
  std::size_t i = 0;
  for (int v = 0; v < cloud.height; ++v) {
    for (int u = 0; u < cloud.width; ++u, ++i) {
      const double z = static_cast<double>(cloud.z[i]);
      if (!std::isfinite(z) || z == 0.0) continue;
      const double x = static_cast<double>(cloud.x[i]) / std::fabs(z);
      const double y = static_cast<double>(cloud.y[i]) / z;
      use(u, v, x, y);
    }
  }
}

}  // namespace

std::optional<CameraFile> estimate_camera(const CloudData& cloud) {
  if (!cloud.organized()) return std::nullopt;
  LineFit columns;
  LineFit rows;
  std::size_t points = 0;
  for_each_ray(cloud, [&](int u, int v, double x, double y) {
    columns.add(x, u);
    rows.add(y, v);
    ++points;
  });
  if (points < kMinPoints) return std::nullopt;
  CameraFile camera;
  camera.width = cloud.width;
  camera.height = cloud.height;
  camera.fx = columns.slope();
  camera.cx = columns.offset();
  camera.fy = rows.slope();
  camera.cy = rows.offset();
  double worst_px = 0.0;
  for_each_ray(cloud, [&](int u, int v, double x, double y) {
    worst_px = std::fmax(worst_px, std::fabs(camera.fx * x + camera.cx - u));
    worst_px = std::fmax(worst_px, std::fabs(camera.fy * y + camera.cy - v));
  });
  const bool pinhole = camera.fx > 1.0 && camera.fy > 1.0 && worst_px <= kMaxResidual_px;
  return pinhole ? std::optional(camera) : std::nullopt;
}

double fitting_unit_m(const CloudData& cloud) {
  for (const float z : cloud.z) {
    const double depth_mm = static_cast<double>(z) / kMillimetre_m;
    if (std::isfinite(depth_mm) && std::fabs(depth_mm - std::nearbyint(depth_mm)) > kWhole_mm) {
      return kTumUnit_m;
    }
  }
  return kMillimetre_m;
}

DepthImage depth_of(const CloudData& cloud, double metres_per_unit) {
  DepthImage image{cloud.width, cloud.height, {}};
  image.pixels.reserve(cloud.size());
  for (const float z : cloud.z) {
    const double counts = std::nearbyint(std::fabs(static_cast<double>(z)) / metres_per_unit);
    const bool readable = counts > 0.0 && counts < 65535.0;
    image.pixels.push_back(readable ? static_cast<std::uint16_t>(counts) : std::uint16_t{0});
  }
  return image;
}

ColorImage colors_of(const CloudData& cloud) {
  if (!cloud.has_color()) return {};
  return {cloud.width, cloud.height, cloud.color};
}

}  // namespace grapnel
