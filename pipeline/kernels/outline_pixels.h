#pragma once

#include <cstddef>
#include <cstdint>

namespace grapnel::kernels {

/// How far behind a pixel of depth z its neighbours still belong to the same surface:
/// slack_m + 8 · max(sigma_per_m2 · z², sigma_floor_m).
struct OutlineLaw {
  float slack_m = 0.0F;
  float sigma_per_m2 = 0.0F;
  float sigma_floor_m = 0.0F;
};

/// That depth.
[[nodiscard]] inline float behind_m(const OutlineLaw& law, float z_m) noexcept {
  const float sigma_m = law.sigma_per_m2 * z_m * z_m;
  return z_m + law.slack_m + 8.0F * (sigma_m > law.sigma_floor_m ? sigma_m : law.sigma_floor_m);
}

inline constexpr std::size_t kOutlinePad = 8;

/// Positions of the pixels of a row (metres, 0 = nothing there) beside which, on one of the four
/// sides, there is nothing or something farther behind. The rows before and after lie `width`
/// elements away; all three hold an element before the first and kOutlinePad behind the last;
/// `found` holds count + kOutlinePad. Returns their number.
std::size_t outline_pixels(const float* row, std::ptrdiff_t width, std::size_t count,
                           const OutlineLaw& law, std::int32_t* found) noexcept;

inline constexpr int kOutwardReach = 3;

/// The way out of the silhouette at pixels found by outline_pixels(): the sum of the steps (px) to
/// all pixels within kOutwardReach both ways where there is nothing or something farther behind.
/// As many rows lie before and after, and as many elements beside, and kOutlinePad behind the last.
void outward_of(const float* row, std::ptrdiff_t width, const std::int32_t* found,
                std::size_t count, const OutlineLaw& law, float* out_u, float* out_v) noexcept;

namespace reference {
void outward_of(const float* row, std::ptrdiff_t width, const std::int32_t* found,
                std::size_t count, const OutlineLaw& law, float* out_u, float* out_v) noexcept;
std::size_t outline_pixels(const float* row, std::ptrdiff_t width, std::size_t count,
                           const OutlineLaw& law, std::int32_t* found) noexcept;
}  // namespace reference

}  // namespace grapnel::kernels
