#include "pipeline/judge/depth_view.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/assert.h"

namespace grapnel {
namespace {

// A step that neither eight sigma nor a surface tilted by 80 degrees over one pixel explains.
constexpr float kStepSigmas = 8.0F;
constexpr float kSteepest = 6.0F;

constexpr std::int32_t kNone = -1;

std::int32_t pack(int u, int v) noexcept { return v * 65536 + u; }

// A shadow of the projector beside a part is at most this wide; beyond it the ground is seen again.
constexpr int kShadow_px = 32;

/// What lies beyond a pixel in one direction: the first reading, over a gap of no reading.
enum class Beyond : std::uint8_t { Same, Behind, Unknown };
Beyond look_beyond(const DepthView& view, int u, int v, int du, int dv, float z,
                   float step_m) noexcept {
  const int reach = 1 + kShadow_px / view.stride;
  for (int k = 1; k <= reach; ++k) {
    const int nu = u + k * du;
    const int nv = v + k * dv;
    if (nu < 0 || nv < 0 || nu >= view.depth.width || nv >= view.depth.height) break;
    const float other = view.z_m(nu, nv);
    if (!(other > 0.0F)) continue;
    // A gap may hide a slope as steep as any.
    const bool behind = view.background(nu, nv) || other > z + step_m * static_cast<float>(k);
    return behind ? Beyond::Behind : Beyond::Same;
  }
  return Beyond::Unknown;
}

bool is_edge(const DepthView& view, int u, int v) noexcept {
  const float z = view.z_m(u, v);
  if (!(z > 0.0F) || view.background(u, v)) return false;
  const float step_m = edge_step_m(view, z);
  return look_beyond(view, u, v, 1, 0, z, step_m) == Beyond::Behind ||
         look_beyond(view, u, v, -1, 0, z, step_m) == Beyond::Behind ||
         look_beyond(view, u, v, 0, 1, z, step_m) == Beyond::Behind ||
         look_beyond(view, u, v, 0, -1, z, step_m) == Beyond::Behind;
}

}  // namespace

float edge_step_m(const DepthView& view, float z_m) noexcept {
  return kStepSigmas * view.noise.sigma_m(z_m) +
         kSteepest * z_m / static_cast<float>(view.intrinsics.fx);
}

std::int32_t DepthView::working_point(int u, int v) const noexcept {
  if (working == nullptr || !working->organised()) return -1;
  const Intrinsics& grid = working->grid.intrinsics;
  const int gu =
      static_cast<int>(std::floor((u - intrinsics.cx) * (grid.fx / intrinsics.fx) + grid.cx + 0.5));
  const int gv =
      static_cast<int>(std::floor((v - intrinsics.cy) * (grid.fy / intrinsics.fy) + grid.cy + 0.5));
  if (gu < 0 || gv < 0 || gu >= working->grid.width || gv >= working->grid.height) return -1;
  return working->grid.point_of[static_cast<std::size_t>(gv * working->grid.width + gu)];
}

void ThinnedDepth::reserve(Arena& arena, std::size_t max_pixels) {
  depth_ = arena.take<std::uint16_t>(max_pixels);
  label_ = arena.take<std::uint8_t>(max_pixels);
}

void ThinnedDepth::thin(DepthView& view, int stride) noexcept {
  const int width = std::max(1, view.box.width() / stride);
  const int height = std::max(1, view.box.height() / stride);
  const int first_u = std::min(view.box.u0 + stride / 2, view.box.u1 - 1);
  const int first_v = std::min(view.box.v0 + stride / 2, view.box.v1 - 1);
  std::size_t k = 0;
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u, ++k) {
      depth_[k] = view.depth.at(first_u + u * stride, first_v + v * stride);
      if (!view.label.empty())
        label_[k] = view.label.at(first_u + u * stride, first_v + v * stride);
    }
  }
  view.depth = ImageView<const std::uint16_t>(depth_.data(), width, height);
  if (!view.label.empty()) view.label = ImageView<const std::uint8_t>(label_.data(), width, height);
  view.intrinsics.width = width;
  view.intrinsics.height = height;
  view.intrinsics.fx /= stride;
  view.intrinsics.fy /= stride;
  view.intrinsics.cx = (view.intrinsics.cx - first_u) / stride;
  view.intrinsics.cy = (view.intrinsics.cy - first_v) / stride;
  view.box = {0, 0, width, height};
  view.stride *= stride;
}

void EdgeMap::reserve(Arena& arena, std::size_t max_pixels) {
  site_ = arena.take<std::int32_t>(max_pixels);
}

void EdgeMap::build(const DepthView& view) noexcept {
  box_ = view.box;
  GRAPNEL_ASSERT(static_cast<std::size_t>(box_.width()) * static_cast<std::size_t>(box_.height()) <=
                 site_.size());
  std::size_t i = 0;
  for (int v = box_.v0; v < box_.v1; ++v) {
    for (int u = box_.u0; u < box_.u1; ++u) {
      site_[i++] = is_edge(view, u, v) ? pack(u, v) : kNone;
    }
  }
  propagate();
}

void EdgeMap::propagate() noexcept {
  const int width = box_.width();
  const int height = box_.height();
  const auto at = [&](int x, int y) -> std::int32_t& {
    return site_[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                 static_cast<std::size_t>(x)];
  };
  const auto square = [&](std::int32_t site, int x, int y) {
    const int du = site % 65536 - (x + box_.u0);
    const int dv = site / 65536 - (y + box_.v0);
    return du * du + dv * dv;
  };
  const auto take = [&](int x, int y, int ox, int oy) {
    if (x + ox < 0 || x + ox >= width || y + oy < 0 || y + oy >= height) return;
    const std::int32_t site = at(x + ox, y + oy);
    std::int32_t& own = at(x, y);
    if (site != kNone && (own == kNone || square(site, x, y) < square(own, x, y))) own = site;
  };
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      take(x, y, -1, 0);
      take(x, y, -1, -1);
      take(x, y, 0, -1);
      take(x, y, 1, -1);
    }
    for (int x = width - 1; x >= 0; --x) take(x, y, 1, 0);
  }
  for (int y = height - 1; y >= 0; --y) {
    for (int x = width - 1; x >= 0; --x) {
      take(x, y, 1, 0);
      take(x, y, 1, 1);
      take(x, y, 0, 1);
      take(x, y, -1, 1);
    }
    for (int x = 0; x < width; ++x) take(x, y, -1, 0);
  }
}

EdgeMap::Nearest EdgeMap::nearest(int u, int v) const noexcept {
  if (!box_.contains(u, v)) return {};
  const std::int32_t site =
      site_[static_cast<std::size_t>(v - box_.v0) * static_cast<std::size_t>(box_.width()) +
            static_cast<std::size_t>(u - box_.u0)];
  if (site == kNone) return {};
  const int eu = site % 65536;
  const int ev = site / 65536;
  return {eu, ev, (eu - u) * (eu - u) + (ev - v) * (ev - v), true};
}

}  // namespace grapnel
