#include "pipeline/judge/depth_view.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "base/assert.h"

namespace grapnel {
namespace {

// A step that neither eight sigma nor a surface tilted by 80 degrees over one pixel explains.
constexpr float kStepSigmas = 8.0F;
constexpr float kSteepest = 6.0F;

constexpr std::size_t kWord = 64;     // pixels of a word of edges
constexpr double kFarthest = 4096.0;  // px: no image is larger

constexpr std::size_t words_of(std::size_t pixels) noexcept { return (pixels + kWord - 1) / kWord; }

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
  bits_ = arena.take<Word>(words_of(max_pixels));
}

void EdgeMap::build(const DepthView& view) noexcept {
  box_ = view.box;
  GRAPNEL_ASSERT(words_of(static_cast<std::size_t>(box_.width()) *
                          static_cast<std::size_t>(box_.height())) <= bits_.size());
  Word bits = 0;
  std::size_t at = 0;
  for (int v = box_.v0; v < box_.v1; ++v) {
    for (int u = box_.u0; u < box_.u1; ++u) {
      bits |= static_cast<Word>(is_edge(view, u, v) ? 1U : 0U) << (at % kWord);
      if (++at % kWord != 0) continue;
      bits_[at / kWord - 1] = bits;
      bits = 0;
    }
  }
  if (at % kWord != 0) bits_[at / kWord] = bits;
}

void EdgeMap::look_along(int u, int v, int off, int& limit, Nearest& nearest) const noexcept {
  if (v < box_.v0 || v >= box_.v1) return;
  const auto width = static_cast<std::size_t>(box_.width());
  const std::size_t begin = static_cast<std::size_t>(v - box_.v0) * width;
  const std::size_t at = begin + static_cast<std::size_t>(u - box_.u0);
  const auto room =
      static_cast<std::size_t>(std::sqrt(static_cast<float>(std::max(0, limit - off * off)))) + 1;
  const auto offer = [&](std::size_t edge) {
    const int across = static_cast<int>(edge - begin) - (u - box_.u0);
    const int square = off * off + across * across;
    if (square > limit) return;
    limit = square - 1;
    nearest = {u + across, v, square, true};
  };
  // To the right, the pixel itself included, then to the left: the first bit is the nearest.
  const std::size_t last = std::min(begin + width - 1, at + room);
  std::size_t w = at / kWord;
  Word bits = bits_[w] >> (at % kWord) << (at % kWord);
  while (bits == 0 && (w + 1) * kWord <= last) bits = bits_[++w];
  if (bits != 0) {
    const std::size_t edge = w * kWord + static_cast<std::size_t>(std::countr_zero(bits));
    if (edge <= last) offer(edge);
  }
  const std::size_t first = at > begin + room ? at - room : begin;
  w = at / kWord;
  bits = bits_[w] << (kWord - 1 - at % kWord) >> (kWord - 1 - at % kWord);
  while (bits == 0 && w * kWord > first) bits = bits_[--w];
  if (bits != 0) {
    const std::size_t edge =
        w * kWord + kWord - 1 - static_cast<std::size_t>(std::countl_zero(bits));
    if (edge >= first) offer(edge);
  }
}

EdgeMap::Nearest EdgeMap::nearest(int u, int v, double reach) const noexcept {
  Nearest nearest;
  if (!box_.contains(u, v) || !(reach >= 0.0)) return nearest;
  const double farthest = std::min(reach, kFarthest);
  int limit = static_cast<int>(farthest * farthest);
  look_along(u, v, 0, limit, nearest);
  for (int off = 1; off * off <= limit; ++off) {
    look_along(u, v - off, off, limit, nearest);
    look_along(u, v + off, off, limit, nearest);
  }
  return nearest;
}

}  // namespace grapnel
