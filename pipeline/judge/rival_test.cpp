#include "pipeline/judge/rival_test.h"

#include <algorithm>
#include <cmath>

#include "base/assert.h"
#include "pipeline/kernels/nearer_row.h"

namespace grapnel {
namespace {

// A deviation of three sigma says all that a reading can say.
constexpr float kMostSquare = 9.0F;
// Predictions nearer than this, in sigma, are not told apart by one reading.
constexpr float kLeastDifference = 1.5F;
// So many sigma before a surface something hides it.
constexpr float kHidden = 3.0F;
// In sensor pixels: what differs must be wider than an edge.
constexpr int kRim_px = 2;
// Below the first, chance and a pose's last millimetre; from the second on, certainty.
constexpr double kLeastGain = 20.0;
constexpr double kEnoughGain = 100.0;
constexpr double kLeastShare = 0.5;
// Beyond doubt: three times what certainty asks.
constexpr double kSureGain = 3.0 * kEnoughGain;
constexpr double kSureShare = 0.9;

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

bool Contrast::alike() const noexcept { return std::fabs(gain) <= kLeastGain; }

bool Contrast::beyond_doubt() const noexcept { return gain >= kSureGain && share >= kSureShare; }

void RivalTest::reserve(Arena& arena, std::size_t max_pixels, std::size_t max_width) {
  z_m_ = arena.take<float>(max_pixels);
  row_first_ = arena.take<float>(max_width + kernels::kNearerPad);
  row_second_ = arena.take<float>(max_width + kernels::kNearerPad);
  sides_ = arena.take<std::int8_t>(max_pixels + kernels::kNearerPad);
}

void RivalTest::keep(const ModelRender& first) noexcept {
  marked_ = first.marked();
  for (int v = marked_.v0; v < marked_.v1; ++v) {
    for (int u = marked_.u0; u < marked_.u1; ++u) z_m_[first.index(u, v)] = first.z_m(u, v);
  }
}

void RivalTest::take_sides(const ModelRender& second, const DepthView& view,
                           const PixelBox& box) noexcept {
  const auto width = static_cast<std::size_t>(box.width());
  GRAPNEL_ASSERT(width + kernels::kNearerPad <= row_first_.size());
  const kernels::NearerLaw law{kLeastDifference, view.noise.sigma_per_m2, view.noise.floor_m};
  const auto copy_row = [&](const float* row, const PixelBox& marked, int v, std::span<float> out) {
    std::fill_n(out.begin(), width, 0.0F);
    if (v < marked.v0 || v >= marked.v1) return;
    std::copy_n(row, marked.width(), out.begin() + (marked.u0 - box.u0));
  };
  const PixelBox& other = second.marked();
  for (int v = box.v0; v < box.v1; ++v) {
    copy_row(z_m_.data() + second.index(marked_.u0, v), marked_, v, row_first_);
    copy_row(second.depths(other.u0, v), other, v, row_second_);
    kernels::nearer_row(row_first_.data(), row_second_.data(), width, law,
                        sides_.data() + static_cast<std::size_t>(v - box.v0) * width);
  }
}

Contrast RivalTest::against(const ModelRender& second, const DepthView& view,
                            double shared_px) noexcept {
  const PixelBox& other = second.marked();
  const int rim = std::max(1, (kRim_px + view.stride - 1) / view.stride);
  const PixelBox box{std::min(marked_.u0, other.u0), std::min(marked_.v0, other.v0),
                     std::max(marked_.u1, other.u1), std::max(marked_.v1, other.v1)};
  take_sides(second, view, box);
  const std::ptrdiff_t down = static_cast<std::ptrdiff_t>(rim) * box.width();
  double sum = 0.0;
  double magnitude = 0.0;
  // Beside the box both predict nothing, so nothing along its border counts.
  for (int v = box.v0 + rim; v < box.v1 - rim; ++v) {
    const std::int8_t* const row =
        sides_.data() + static_cast<std::ptrdiff_t>(v - box.v0) * box.width();
    for (int u = box.u0 + rim; u < box.u1 - rim; ++u) {
      const std::int8_t* const at = row + (u - box.u0);
      if (u + 8 <= box.u1 && eight_labels(reinterpret_cast<const std::uint8_t*>(at)) == 0) {
        u += 7;
        continue;
      }
      const std::int8_t side = *at;
      if (side == 0) continue;
      // Along edges predictions differ by the reach of their discs and readings are mixed.
      if (at[-rim] != side || at[rim] != side || at[-down] != side || at[down] != side) continue;
      const float measured = view.z_m(u, v);
      if (!(measured > 0.0F)) continue;
      const float sigma_m = view.noise.sigma_m(measured);
      const bool of_part = view.of_object(u, v);
      const float a = marked_.contains(u, v) ? z_m_[second.index(u, v)] : 0.0F;
      const float b = other.contains(u, v) ? second.z_m(u, v) : 0.0F;
      // Something else lies before what only one pose predicts: whether that is there, nobody sees.
      const bool of_one = (a > 0.0F) != (b > 0.0F);
      if (of_one && !of_part && measured < std::max(a, b) - kHidden * sigma_m) continue;
      const float difference =
          square_off(b, measured, sigma_m, of_part) - square_off(a, measured, sigma_m, of_part);
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
