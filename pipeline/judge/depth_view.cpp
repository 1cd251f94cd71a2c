#include "pipeline/judge/depth_view.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "base/assert.h"
#include "pipeline/kernels/edge_candidates.h"

namespace grapnel {
namespace {

constexpr std::size_t kWord = 64;     // pixels of a word of edges
constexpr int kStretch_px = 256;      // pixels of a row that are looked through at once
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

kernels::EdgeLaw edge_law(const DepthView& view) noexcept {
  return {view.metres_per_unit, view.noise.sigma_per_m2, view.noise.floor_m,
          static_cast<float>(view.intrinsics.fx)};
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
  return kernels::edge_step_m(edge_law(view), z_m);
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
  const auto width = static_cast<std::size_t>(std::max(0, box_.width()));
  const std::size_t words = words_of(width * static_cast<std::size_t>(std::max(0, box_.height())));
  GRAPNEL_ASSERT(words <= bits_.size());
  std::fill_n(bits_.begin(), words, Word{0});
  const kernels::EdgeLaw law = edge_law(view);
  // Pixels of the image's own border have no four neighbours; each is looked at by itself.
  const int inner_u0 = std::max(box_.u0, 1);
  const int inner_u1 = std::min(box_.u1, view.depth.width - 1);
  std::array<std::int32_t, kStretch_px + kernels::kCandidatePad> found;
  for (int v = box_.v0; v < box_.v1; ++v) {
    const bool inner = v >= 1 && v + 1 < view.depth.height && inner_u0 < inner_u1;
    for (int u = box_.u0; u < (inner ? inner_u0 : box_.u1); ++u) mark(view, u, v);
    if (!inner) continue;
    for (int first = inner_u0; first < inner_u1; first += kStretch_px) {
      kernels::LabelledRow row;
      row.depth = view.depth.row(v) + first;
      row.depth_stride = static_cast<std::ptrdiff_t>(view.depth.stride);
      if (!view.label.empty()) {
        row.label = view.label.row(v) + first;
        row.label_stride = static_cast<std::ptrdiff_t>(view.label.stride);
      }
      const int count = std::min(inner_u1 - first, kStretch_px);
      const std::size_t candidates =
          kernels::edge_candidates(row, static_cast<std::size_t>(count), law, found.data());
      for (std::size_t k = 0; k < candidates; ++k) mark(view, first + found[k], v);
    }
    for (int u = std::max(inner_u1, inner_u0); u < box_.u1; ++u) mark(view, u, v);
  }
}

void EdgeMap::mark(const DepthView& view, int u, int v) noexcept {
  if (!is_edge(view, u, v)) return;
  const auto at = static_cast<std::size_t>((v - box_.v0) * box_.width() + (u - box_.u0));
  bits_[at / kWord] |= Word{1} << (at % kWord);
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
