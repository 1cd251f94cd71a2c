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

/// The four next pixels are read, of the foreground and not behind: most pixels of a surface.
bool goes_on(const DepthView& view, int u, int v, float limit_m) noexcept {
  if (u < 1 || v < 1 || u + 1 >= view.depth.width || v + 1 >= view.depth.height) return false;
  const auto stride = static_cast<std::ptrdiff_t>(view.depth.stride);
  const std::uint16_t* depth = view.depth.row(v) + u;
  const std::uint16_t nearest =
      std::min(std::min(depth[-1], depth[1]), std::min(depth[-stride], depth[stride]));
  const std::uint16_t farthest =
      std::max(std::max(depth[-1], depth[1]), std::max(depth[-stride], depth[stride]));
  if (nearest == 0 || view.metres_per_unit * static_cast<float>(farthest) > limit_m) return false;
  if (view.label.empty()) return true;
  const auto label_stride = static_cast<std::ptrdiff_t>(view.label.stride);
  const std::uint8_t* label = view.label.row(v) + u;
  return label[-1] != 0 && label[1] != 0 && label[-label_stride] != 0 && label[label_stride] != 0;
}

bool is_edge(const DepthView& view, int u, int v) noexcept {
  const float z = view.z_m(u, v);
  if (!(z > 0.0F) || view.background(u, v)) return false;
  const float step_m = edge_step_m(view, z);
  if (goes_on(view, u, v, z + step_m)) return false;
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

/// The nearest edge known to a pixel, while neighbours offer theirs.
class EdgeMap::Offer {
 public:
  Offer(std::int32_t own, int u, int v) noexcept : u_(u), v_(v), site_(own) {
    if (own != kNone) square_ = square(own);
  }
  void consider(std::int32_t site) noexcept {
    if (site == kNone || site == site_) return;
    const int other = square(site);
    if (site_ != kNone && other >= square_) return;
    site_ = site;
    square_ = other;
  }
  [[nodiscard]] std::int32_t site() const noexcept { return site_; }

 private:
  [[nodiscard]] int square(std::int32_t site) const noexcept {
    const int du = (site & 0xFFFF) - u_;
    const int dv = (site >> 16) - v_;
    return du * du + dv * dv;
  }

  int u_;
  int v_;
  std::int32_t site_;
  int square_ = 0;
};

void EdgeMap::propagate() noexcept {
  const int width = box_.width();
  const int height = box_.height();
  // One sweep down and one up, each with a pass back along the row.
  const auto sweep = [&](int y, int from_y, int first, int last, int step) {
    std::int32_t* row = site_.data() + static_cast<std::ptrdiff_t>(y) * width;
    const std::int32_t* other = from_y >= 0 && from_y < height
                                    ? site_.data() + static_cast<std::ptrdiff_t>(from_y) * width
                                    : nullptr;
    for (int x = first; x != last + step; x += step) {
      Offer offer(row[x], x + box_.u0, y + box_.v0);
      const int before = x - step;
      const int after = x + step;
      if (x != first) offer.consider(row[before]);
      if (other != nullptr) {
        if (x != first) offer.consider(other[before]);
        offer.consider(other[x]);
        if (x != last) offer.consider(other[after]);
      }
      row[x] = offer.site();
    }
    for (int x = last - step; x != first - step; x -= step) {
      Offer offer(row[x], x + box_.u0, y + box_.v0);
      offer.consider(row[x + step]);
      row[x] = offer.site();
    }
  };
  for (int y = 0; y < height; ++y) sweep(y, y - 1, 0, width - 1, 1);
  for (int y = height - 1; y >= 0; --y) sweep(y, y + 1, width - 1, 0, -1);
}

EdgeMap::Nearest EdgeMap::nearest(int u, int v) const noexcept {
  if (!box_.contains(u, v)) return {};
  const std::int32_t site =
      site_[static_cast<std::size_t>(v - box_.v0) * static_cast<std::size_t>(box_.width()) +
            static_cast<std::size_t>(u - box_.u0)];
  if (site == kNone) return {};
  const int eu = site & 0xFFFF;
  const int ev = site >> 16;
  return {eu, ev, (eu - u) * (eu - u) + (ev - v) * (ev - v), true};
}

}  // namespace grapnel
