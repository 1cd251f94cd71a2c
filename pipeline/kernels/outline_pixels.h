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

inline constexpr std::size_t kOutlinePad = 8;

/// Positions of the pixels of a row (metres, 0 = nothing there) beside which, on one of the four
/// sides, there is nothing or something farther behind. The rows before and after lie `width`
/// elements away; all three hold an element before the first and kOutlinePad behind the last;
/// `found` holds count + kOutlinePad. Returns their number.
std::size_t outline_pixels(const float* row, std::ptrdiff_t width, std::size_t count,
                           const OutlineLaw& law, std::int32_t* found) noexcept;

namespace reference {
std::size_t outline_pixels(const float* row, std::ptrdiff_t width, std::size_t count,
                           const OutlineLaw& law, std::int32_t* found) noexcept;
}  // namespace reference

}  // namespace grapnel::kernels
