// What lies along a pose's edges and beside it, looked at in pieces.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "pipeline/judge/verification.h"

namespace grapnel {
namespace {

// A piece along an edge is at least this wide: mixed pixels make narrower ones.
constexpr int kPieceWidth_px = 4;
// Neighbouring predictions nearer to each other than this many tolerances are one steep surface.
constexpr float kSteep = 4.0F;

}  // namespace

bool Verification::explained_at_rim(const ModelRender& render, const DepthView& view, int u, int v,
                                    int rim, float limit_m) const noexcept {
  const float measured = view.z_m(u, v);
  if (!(measured > 0.0F) || std::fabs(measured - render.z_m(u, v)) <= limit_m) return true;
  const bool of_object = view.of_object(u, v);
  // Something else in front.
  if (!of_object && measured < render.z_m(u, v)) return true;
  const auto predicted = [&](int pu, int pv) {
    return view.box.contains(pu, pv) ? render.z_m(pu, pv) : 0.0F;
  };
  for (int dv = -rim; dv <= rim; ++dv) {
    for (int du = -rim; du <= rim; ++du) {
      const float here = predicted(u + du, v + dv);
      if (!(here > 0.0F)) {
        if (!of_object) return true;
        continue;
      }
      if (std::fabs(measured - here) <= limit_m) return true;
      for (const float next : {predicted(u + du + 1, v + dv), predicted(u + du, v + dv + 1)}) {
        const bool steep = next > 0.0F && std::fabs(next - here) <= kSteep * limit_m;
        if (steep && measured > std::min(here, next) && measured < std::max(here, next)) {
          return true;
        }
      }
    }
  }
  return false;
}

double Verification::largest_piece_m2(Kind seed, Kind of, const PixelBox& box,
                                      const ModelRender& render, const DepthView& view) noexcept {
  double largest_m2 = 0.0;
  for (int v = box.v0; v < box.v1; ++v) {
    for (int u = box.u0; u < box.u1; ++u) {
      const Kind* const from = &kind_[render.index(u, v)];
      const auto* const found = static_cast<const Kind*>(
          std::memchr(from, static_cast<int>(seed), static_cast<std::size_t>(box.u1 - u)));
      if (found == nullptr) break;
      u += static_cast<int>(found - from);
      double area_m2 = 0.0;
      std::size_t top = 0;
      stack_[top++] = v * 65536 + u;
      kind_[render.index(u, v)] = Kind::Outside;
      while (top > 0) {
        const std::int32_t pixel = stack_[--top];
        const int pu = pixel % 65536;
        const int pv = pixel / 65536;
        const float predicted = render.z_m(pu, pv);
        const auto z = static_cast<double>(predicted > 0.0F ? predicted : view.z_m(pu, pv));
        area_m2 += z * z / (view.intrinsics.fx * view.intrinsics.fy);
        constexpr std::array<std::array<int, 2>, 4> kAround = {{{1, 0}, {-1, 0}, {0, 1}, {0, -1}}};
        for (const auto& [du, dv] : kAround) {
          if (!box.contains(pu + du, pv + dv)) continue;
          Kind& kind = kind_[render.index(pu + du, pv + dv)];
          if (kind != seed && kind != of) continue;
          kind = Kind::Outside;
          stack_[top++] = (pv + dv) * 65536 + pu + du;
        }
      }
      largest_m2 = std::max(largest_m2, area_m2);
    }
  }
  return largest_m2;
}

double Verification::broad_piece_m2(Kind of, const PixelBox& box, const ModelRender& render,
                                    const DepthView& view) noexcept {
  const int width = std::max(2, view.own_px(kPieceWidth_px));
  for (int v = box.v0; v + width <= box.v1; ++v) {
    for (int u = box.u0; u + width <= box.u1; ++u) {
      bool whole = kind_[render.index(u, v)] == of;
      for (int dv = 0; whole && dv < width; ++dv) {
        for (int du = 0; whole && du < width; ++du) {
          whole = kind_[render.index(u + du, v + dv)] == of;
        }
      }
      if (whole) kind_[render.index(u, v)] = Kind::Piece;
    }
  }
  return largest_piece_m2(Kind::Piece, of, box, render, view);
}

double Verification::left_over_m2(const LeftOver& left_over, const ModelRender& render,
                                  const DepthView& view) noexcept {
  bool any = false;
  for (int v = view.box.v0; v < view.box.v1; ++v) {
    Kind* const kinds = &kind_[render.index(view.box.u0, v)];
    std::fill_n(kinds, view.box.width(), Kind::Outside);
    for (int u = view.box.u0; u < view.box.u1; ++u) {
      if (view.eight_background(u, v)) {
        u += 7;
        continue;
      }
      if (!left_over(u, v)) continue;
      kinds[u - view.box.u0] = Kind::LeftOver;
      any = true;
    }
  }
  if (!any) return 0.0;
  return broad_piece_m2(Kind::LeftOver, view.box, render, view);
}

}  // namespace grapnel
