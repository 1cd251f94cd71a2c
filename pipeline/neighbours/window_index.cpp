#include "pipeline/neighbours/window_index.h"

#include <algorithm>
#include <cmath>

namespace grapnel {

namespace {

/// Beyond this a surface does not belong to its grid: it was moved, or the intrinsics are wrong.
constexpr float kMaxSlackPx = 2.0F;

int clamped_pixel(double value, int size) noexcept {
  return static_cast<int>(std::clamp(value, -1.0, static_cast<double>(size)));
}

}  // namespace

void WindowIndex::reserve(Arena& arena, std::size_t max_grid_pixels) {
  before_ = arena.take<std::int32_t>(max_grid_pixels > 0 ? max_grid_pixels + 1 : 0);
}

bool WindowIndex::build(const Surface& surface) noexcept {
  const Surface::Grid& grid = surface.grid;
  if (!surface.organised() || !(grid.intrinsics.fx > 0.0) || !(grid.intrinsics.fy > 0.0)) {
    return false;
  }
  const std::size_t pixels =
      static_cast<std::size_t>(grid.width) * static_cast<std::size_t>(grid.height);
  if (pixels + 1 > before_.size()) return false;
  width_ = grid.width;
  height_ = grid.height;
  fx_ = static_cast<float>(grid.intrinsics.fx);
  fy_ = static_cast<float>(grid.intrinsics.fy);
  cx_ = static_cast<float>(grid.intrinsics.cx);
  cy_ = static_cast<float>(grid.intrinsics.cy);

  std::int32_t count = 0;
  for (std::size_t pixel = 0; pixel < pixels; ++pixel) {
    before_[pixel] = count;
    const std::int32_t point = grid.point_of[pixel];
    if (point < 0) continue;
    if (point != count) return false;
    ++count;
  }
  before_[pixels] = count;
  if (static_cast<std::size_t>(count) != surface.size) return false;

  slack_px_ = 0.0F;
  for (std::size_t i = 0; i < surface.size; ++i) {
    if (!(surface.z[i] > 0.0F)) return false;
    const std::int32_t pixel = grid.pixel_of[i];
    const std::int32_t row = pixel / width_;
    const float inverse = 1.0F / surface.z[i];
    const float u = fx_ * surface.x[i] * inverse + cx_;
    const float v = fy_ * surface.y[i] * inverse + cy_;
    slack_px_ = std::max({slack_px_, std::fabs(u - static_cast<float>(pixel % width_)),
                          std::fabs(v - static_cast<float>(row))});
  }
  return slack_px_ <= kMaxSlackPx;
}

WindowIndex::Window WindowIndex::window(const Vec3f& low, const Vec3f& high,
                                        float radius_m) const noexcept {
  Window all{0, width_ - 1, 0, height_ - 1};
  const double r = static_cast<double>(radius_m) * 1.000001;
  const double near_z = static_cast<double>(low.z()) - r;
  const double far_z = static_cast<double>(high.z()) + r;
  if (far_z <= 0.0) return {};
  if (near_z <= 0.0) return all;
  // The box around the spheres, seen from the camera: its extreme rays pass its near or far
  // corners.
  const double slack = static_cast<double>(slack_px_) + 0.01;
  const auto lowest = [&](float side) {
    const double least = static_cast<double>(side) - r;
    return least / (least < 0.0 ? near_z : far_z);
  };
  const auto highest = [&](float side) {
    const double most = static_cast<double>(side) + r;
    return most / (most > 0.0 ? near_z : far_z);
  };
  Window window;
  window.left = std::max(0, clamped_pixel(std::floor(static_cast<double>(fx_) * lowest(low.x()) +
                                                     static_cast<double>(cx_) - slack),
                                          width_));
  window.right =
      std::min(width_ - 1, clamped_pixel(std::ceil(static_cast<double>(fx_) * highest(high.x()) +
                                                   static_cast<double>(cx_) + slack),
                                         width_));
  window.top = std::max(0, clamped_pixel(std::floor(static_cast<double>(fy_) * lowest(low.y()) +
                                                    static_cast<double>(cy_) - slack),
                                         height_));
  window.bottom =
      std::min(height_ - 1, clamped_pixel(std::ceil(static_cast<double>(fy_) * highest(high.y()) +
                                                    static_cast<double>(cy_) + slack),
                                          height_));
  if (window.left > window.right) return {};
  return window;
}

}  // namespace grapnel
