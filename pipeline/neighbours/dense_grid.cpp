#include "pipeline/neighbours/dense_grid.h"

#include <algorithm>
#include <cmath>

namespace grapnel {
namespace {

constexpr int kBorder = kernels::kMaxWindowReach;
// No sum of three squares of it overflows.
constexpr float kAway = 1e18F;
constexpr float kMaxSlack_px = 0.6F;

/// Elements of a plane with its border.
std::size_t bordered(int width, int height) noexcept {
  return static_cast<std::size_t>(height + 2 * kBorder) *
             (static_cast<std::size_t>(width) + 2 * kBorder + kernels::kLanes) +
         2 * kernels::kLanes;
}

}  // namespace

void DenseGrid::reserve(Arena& arena, int max_width, int max_height) {
  const std::size_t room =
      std::max(bordered(max_width, max_height), bordered(max_height, max_width));
  for (std::span<float>* plane : {&x_, &y_, &z_}) *plane = arena.take<float>(room);
}

bool DenseGrid::build(const Surface& surface) noexcept {
  const Surface::Grid& grid = surface.grid;
  if (!surface.organised() || !(grid.intrinsics.fx > 0.0) || !(grid.intrinsics.fy > 0.0)) {
    return false;
  }
  if (bordered(grid.width, grid.height) > x_.size()) return false;
  fx_ = static_cast<float>(grid.intrinsics.fx);
  fy_ = static_cast<float>(grid.intrinsics.fy);
  cx_ = static_cast<float>(grid.intrinsics.cx);
  cy_ = static_cast<float>(grid.intrinsics.cy);
  planes_.stride = grid.width + 2 * kBorder + static_cast<std::ptrdiff_t>(kernels::kLanes);
  const std::ptrdiff_t origin = kBorder * planes_.stride + kBorder;
  planes_.x = x_.data() + origin;
  planes_.y = y_.data() + origin;
  planes_.z = z_.data() + origin;
  copy_points(surface);
  return slack_px_ <= kMaxSlack_px;
}

void DenseGrid::copy_points(const Surface& surface) noexcept {
  const Surface::Grid& grid = surface.grid;
  const std::size_t filled = bordered(grid.width, grid.height);
  for (std::span<float>* plane : {&x_, &y_, &z_}) std::fill_n(plane->begin(), filled, kAway);
  slack_px_ = 0.0F;
  std::size_t pixel = 0;
  for (int v = 0; v < grid.height; ++v) {
    std::size_t to = static_cast<std::size_t>((v + kBorder) * planes_.stride + kBorder);
    for (int u = 0; u < grid.width; ++u, ++to, ++pixel) {
      if (grid.point_of[pixel] < 0) continue;
      const auto i = static_cast<std::size_t>(grid.point_of[pixel]);
      x_[to] = surface.x[i];
      y_[to] = surface.y[i];
      z_[to] = surface.z[i];
      const float inverse = surface.z[i] > 0.0F ? 1.0F / surface.z[i] : kAway;
      const float off_u = fx_ * surface.x[i] * inverse + cx_ - static_cast<float>(u);
      const float off_v = fy_ * surface.y[i] * inverse + cy_ - static_cast<float>(v);
      slack_px_ = std::max({slack_px_, std::fabs(off_u), std::fabs(off_v)});
    }
  }
}

float DenseGrid::least_outside_m2(int u, int v, float z_m, int reach) const noexcept {
  // Outside lies beyond one of four planes through the camera, each at least this many pixels
  // from the point: distance² = z² px² / (f² + (side - centre)²).
  const float px = static_cast<float>(reach + 1) - 2.0F * slack_px_;
  const float far_u = std::fabs(static_cast<float>(u) - cx_) + static_cast<float>(reach + 2);
  const float far_v = std::fabs(static_cast<float>(v) - cy_) + static_cast<float>(reach + 2);
  const float across = std::max(fx_ * fx_ + far_u * far_u, fy_ * fy_ + far_v * far_v);
  return z_m * z_m * px * px / across * 0.99999F;
}

}  // namespace grapnel
