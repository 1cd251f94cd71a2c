#include "pipeline/preprocess/integral_normals.h"

#include <algorithm>
#include <cmath>

#include "pipeline/neighbours/symmetric3.h"

namespace grapnel {
namespace {

using By = IntegralNormalsParams::By;

/// Windows of this edge or less give no normal.
constexpr float kSmallest_px = 2.0F;
/// Second eigenvalue to largest below which a window's points are a line.
constexpr double kLineRatio = 1e-4;
constexpr float kStraight = 1.0F;
constexpr float kDiagonal = 1.4F;

constexpr std::size_t channels_of(By by) noexcept { return by == By::CovarianceMatrix ? 9 : 3; }

std::size_t pixels_of(const Surface::Grid& grid) noexcept {
  return static_cast<std::size_t>(grid.width) * static_cast<std::size_t>(grid.height);
}

std::int32_t point_at(const Surface& surface, int u, int v) noexcept {
  return surface.grid
      .point_of[static_cast<std::size_t>(v) * static_cast<std::size_t>(surface.grid.width) +
                static_cast<std::size_t>(u)];
}

/// From the pixel before to the pixel behind (u, v); false where one is missing.
bool step_across(const Surface& surface, int u, int v, int du, int dv, double* step) noexcept {
  const int before_u = u - du;
  const int before_v = v - dv;
  if (before_u < 0 || before_v < 0 || u + du >= surface.grid.width ||
      v + dv >= surface.grid.height) {
    return false;
  }
  const std::int32_t before = point_at(surface, before_u, before_v);
  const std::int32_t behind = point_at(surface, u + du, v + dv);
  if (before < 0 || behind < 0) return false;
  const Vec3d difference = surface.point(static_cast<std::size_t>(behind)).cast<double>() -
                           surface.point(static_cast<std::size_t>(before)).cast<double>();
  std::copy_n(difference.data(), 3, step);
  return true;
}

}  // namespace

FieldTable integral_normals_fields() noexcept {
  using P = IntegralNormalsParams;
  static constexpr std::array<std::string_view, 4> kBy = {
      "covariance_matrix", "average_3d_gradient", "average_depth_change", "simple_3d_gradient"};
  static constexpr std::array kFields = {
      choice_field<&P::by>("by", kBy, "what of a window's sums the normal is made of"),
      number_field<&P::smoothing_px>("smoothing_px", "px", 3.0, 200.0,
                                     "edge of the window where no step is near"),
      number_field<&P::max_depth_change>(
          "max_depth_change", "", 1e-4, 10.0,
          "change of depth from pixel to pixel, over twice (depth + 1 m), that is a step"),
  };
  return kFields;
}

void IntegralNormals::reserve(Arena& arena, const Limits& limits) {
  const auto edge = static_cast<std::size_t>(std::max(limits.max_width, limits.max_height));
  const std::size_t pixels =
      static_cast<std::size_t>(limits.max_width) * static_cast<std::size_t>(limits.max_height);
  along_.reserve(arena, channels_of(params_.by), pixels, edge);
  if (params_.by == By::Average3dGradient) down_.reserve(arena, 3, pixels, edge);
  distance_px_ = arena.take<float>(pixels);
}

/// The chamfer distance of PCL, two passes over the image.
void IntegralNormals::measure_distances(const Surface& surface) noexcept {
  const int width = surface.grid.width;
  const int height = surface.grid.height;
  const auto at = [&](int u, int v) -> float& {
    return distance_px_[static_cast<std::size_t>(v) * static_cast<std::size_t>(width) +
                        static_cast<std::size_t>(u)];
  };
  const auto far = static_cast<float>(width + height);
  std::fill_n(distance_px_.begin(), pixels_of(surface.grid), far);
  const auto mark = [&](int u, int v, int u2, int v2) {
    const std::int32_t a = point_at(surface, u, v);
    const std::int32_t b = point_at(surface, u2, v2);
    bool breaks = a < 0 || b < 0;
    if (!breaks) {
      const double z = static_cast<double>(surface.z[static_cast<std::size_t>(a)]);
      const double step = static_cast<double>(surface.z[static_cast<std::size_t>(b)]) - z;
      breaks = std::fabs(step) > params_.max_depth_change * (std::fabs(z) + 1.0) * 2.0;
    }
    if (breaks) at(u, v) = at(u2, v2) = 0.0F;
  };
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      if (u + 1 < width) mark(u, v, u + 1, v);
      if (v + 1 < height) mark(u, v, u, v + 1);
    }
  }
  const auto shorten = [&](int u, int v, int side) {
    // The three neighbours of the row before (side -1) or behind, and the one of the row itself.
    float least = at(u, v);
    for (int du = -1; du <= 1; ++du) {
      if (u + du < 0 || u + du >= width || v + side < 0 || v + side >= height) continue;
      least = std::min(least, at(u + du, v + side) + (du == 0 ? kStraight : kDiagonal));
    }
    if (u + side >= 0 && u + side < width) least = std::min(least, at(u + side, v) + kStraight);
    at(u, v) = least;
  };
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) shorten(u, v, -1);
  }
  for (int v = height - 1; v >= 0; --v) {
    for (int u = width - 1; u >= 0; --u) shorten(u, v, 1);
  }
}

void IntegralNormals::sum_up(const Surface& surface) noexcept {
  const int width = surface.grid.width;
  const int height = surface.grid.height;
  if (params_.by == By::Average3dGradient) {
    along_.fill(width, height,
                [&](int u, int v, double* step) { return step_across(surface, u, v, 1, 0, step); });
    down_.fill(width, height,
               [&](int u, int v, double* step) { return step_across(surface, u, v, 0, 1, step); });
    return;
  }
  along_.fill(width, height, [&](int u, int v, double* values) {
    const std::int32_t point = point_at(surface, u, v);
    if (point < 0) return false;
    const Vec3d p = surface.point(static_cast<std::size_t>(point)).cast<double>();
    std::copy_n(p.data(), 3, values);
    if (params_.by == By::CovarianceMatrix) {
      Symmetric3 products;
      products.add(p.x(), p.y(), p.z());
      const double list[6] = {products.xx, products.xy, products.xz,
                              products.yy, products.yz, products.zz};
      std::copy_n(list, 6, values + 3);
    }
    return true;
  });
}

Vec3d IntegralNormals::by_covariance(const PixelWindow& window) const noexcept {
  const auto count = static_cast<double>(along_.count(window));
  if (count < 3.0) return Vec3d::Zero();
  const auto mean = [&](std::size_t channel) { return along_.sum(channel, window) / count; };
  const Symmetric3 spread = Symmetric3{mean(3), mean(4), mean(5), mean(6), mean(7), mean(8)}.about(
      Vec3d(mean(0), mean(1), mean(2)));
  const Vec3d values = eigenvalues_symmetric3(spread);
  if (!(values[1] > kLineRatio * values[2])) return Vec3d::Zero();
  return smallest_eigenvector(spread, values);
}

Vec3d IntegralNormals::by_gradient(const PixelWindow& window) const noexcept {
  const Vec3d along(along_.sum(0, window), along_.sum(1, window), along_.sum(2, window));
  const Vec3d down(down_.sum(0, window), down_.sum(1, window), down_.sum(2, window));
  return down.cross(along);
}

Vec3d IntegralNormals::by_depth_change(int u, int v, int edge) const noexcept {
  // Four windows of half the edge beside the pixel.
  const int half = edge / 2;
  const int quarter = edge / 4;
  const auto mean = [&](int first_u, int first_v) {
    const PixelWindow window = {first_u, first_v, half, half};
    const double count = std::max(1, along_.count(window));
    return Vec3d(along_.sum(0, window) / count, along_.sum(1, window) / count,
                 along_.sum(2, window) / count);
  };
  const Vec3d along = mean(u + 1, v - quarter) - mean(u - half, v - quarter);
  const Vec3d down = mean(u - quarter, v + 1) - mean(u - quarter, v - half);
  return down.cross(along);
}

Vec3d IntegralNormals::by_outermost(const PixelWindow& window) const noexcept {
  const auto sums = [&](const PixelWindow& w) {
    return Vec3d(along_.sum(0, w), along_.sum(1, w), along_.sum(2, w));
  };
  const int half_u = window.width / 2;
  const int half_v = window.height / 2;
  const Vec3d along = sums({window.u + 2 * half_u, window.v, 1, window.height}) -
                      sums({window.u, window.v, 1, window.height});
  const Vec3d down = sums({window.u, window.v + 2 * half_v, window.width, 1}) -
                     sums({window.u, window.v, window.width, 1});
  return down.cross(along);
}

Vec3d IntegralNormals::normal_at(int u, int v, int edge) const noexcept {
  const PixelWindow window = {u - edge / 2, v - edge / 2, edge, edge};
  switch (params_.by) {
    case By::CovarianceMatrix:
      return by_covariance(window);
    case By::Average3dGradient:
      return by_gradient(window);
    case By::AverageDepthChange:
      return by_depth_change(u, v, edge);
    case By::Simple3dGradient:
      return by_outermost(window);
  }
  return Vec3d::Zero();
}

Status IntegralNormals::estimate(Surface& surface) noexcept {
  const Surface::Grid& grid = surface.grid;
  if (surface.size == 0) return Error{Code::TooFewPoints, Stage::Normals, 0};
  if (!surface.organised() || !surface.all_finite()) {
    return Error{Code::BadParameter, Stage::Normals, 0};
  }
  if (pixels_of(grid) > distance_px_.size() || !along_.fits(grid.width, grid.height)) {
    return Error{Code::CapacityExceeded, Stage::Normals, grid.width};
  }
  measure_distances(surface);
  sum_up(surface);
  for (std::size_t i = 0; i < surface.size; ++i) {
    const int u = grid.pixel_of[i] % grid.width;
    const int v = grid.pixel_of[i] / grid.width;
    // The window and what it is compared with lie inside the image.
    const int room = 2 * std::min({u, v, grid.width - 1 - u, grid.height - 1 - v}) + 1;
    const float edge =
        std::min({distance_px_[static_cast<std::size_t>(grid.pixel_of[i])],
                  static_cast<float>(params_.smoothing_px), static_cast<float>(room)});
    Vec3d normal = Vec3d::Zero();
    if (edge > kSmallest_px) normal = normal_at(u, v, static_cast<int>(edge));
    const double length = normal.norm();
    if (length > 0.0) normal /= length;
    if (normal.dot((surface.viewpoint - surface.point(i)).cast<double>()) < 0.0) normal = -normal;
    surface.nx[i] = static_cast<float>(normal.x());
    surface.ny[i] = static_cast<float>(normal.y());
    surface.nz[i] = static_cast<float>(normal.z());
  }
  return {};
}

}  // namespace grapnel
