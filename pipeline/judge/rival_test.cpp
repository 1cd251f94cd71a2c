#include "pipeline/judge/rival_test.h"

#include <algorithm>
#include <cmath>

namespace grapnel {
namespace {

// A deviation of three sigma says all that a reading can say.
constexpr float kMostSquare = 9.0F;
// Predictions nearer than this, in sigma, are not told apart by one reading.
constexpr float kLeastDifference = 1.5F;
// In sensor pixels: what differs must be wider than an edge.
constexpr int kRim_px = 2;
// Below the first, chance and a pose's last millimetre; from the second on, certainty.
constexpr double kLeastGain = 20.0;
constexpr double kEnoughGain = 100.0;
constexpr double kLeastShare = 0.5;

float square_off(float predicted, float measured, float sigma_m, bool of_part) noexcept {
  // Where a pose predicts nothing, nothing of the part should be measured.
  if (!(predicted > 0.0F)) return of_part ? kMostSquare : 0.0F;
  const float off = (measured - predicted) / sigma_m;
  return std::min(off * off, kMostSquare);
}

}  // namespace

double Contrast::certainty() const noexcept {
  return std::clamp((share - kLeastShare) / (1.0 - kLeastShare), 0.0, 1.0) *
         std::clamp((gain - kLeastGain) / (kEnoughGain - kLeastGain), 0.0, 1.0);
}

void RivalTest::reserve(Arena& arena, std::size_t max_pixels) {
  z_m_ = arena.take<float>(max_pixels);
}

void RivalTest::keep(const ModelRender& first) noexcept {
  marked_ = first.marked();
  for (int v = marked_.v0; v < marked_.v1; ++v) {
    for (int u = marked_.u0; u < marked_.u1; ++u) z_m_[first.index(u, v)] = first.z_m(u, v);
  }
}

int RivalTest::nearer(const ModelRender& second, const DepthView& view, int u,
                      int v) const noexcept {
  const float a = first_z_m(second, u, v);
  const float b = second.marked().contains(u, v) ? second.z_m(u, v) : 0.0F;
  if (!(a > 0.0F)) return b > 0.0F ? -1 : 0;
  if (!(b > 0.0F)) return 1;
  const float least = kLeastDifference * view.noise.sigma_m(std::min(a, b));
  return a < b - least ? 1 : (b < a - least ? -1 : 0);
}

Contrast RivalTest::against(const ModelRender& second, const DepthView& view,
                            double shared_px) const noexcept {
  const PixelBox& other = second.marked();
  const int rim = std::max(1, (kRim_px + view.stride - 1) / view.stride);
  double sum = 0.0;
  double magnitude = 0.0;
  for (int v = std::min(marked_.v0, other.v0); v < std::max(marked_.v1, other.v1); ++v) {
    for (int u = std::min(marked_.u0, other.u0); u < std::max(marked_.u1, other.u1); ++u) {
      const int side = nearer(second, view, u, v);
      if (side == 0) continue;
      // Along edges predictions differ by the reach of their discs and readings are mixed.
      if (nearer(second, view, u - rim, v) != side || nearer(second, view, u + rim, v) != side ||
          nearer(second, view, u, v - rim) != side || nearer(second, view, u, v + rim) != side) {
        continue;
      }
      const float measured = view.z_m(u, v);
      if (!(measured > 0.0F)) continue;
      const float sigma_m = view.noise.sigma_m(measured);
      const bool of_part = view.of_object(u, v);
      const float b = other.contains(u, v) ? second.z_m(u, v) : 0.0F;
      const float difference = square_off(b, measured, sigma_m, of_part) -
                               square_off(first_z_m(second, u, v), measured, sigma_m, of_part);
      sum += static_cast<double>(difference);
      magnitude += static_cast<double>(std::fabs(difference));
    }
  }
  Contrast contrast;
  contrast.gain = sum / std::max(1.0, shared_px);
  contrast.share = magnitude > 0.0 ? sum / magnitude : 0.0;
  return contrast;
}

}  // namespace grapnel
