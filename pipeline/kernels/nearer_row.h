#pragma once

#include <cstddef>
#include <cstdint>

namespace grapnel::kernels {

/// Depths nearer to each other than least_sigmas · max(sigma_per_m2 · z², sigma_floor_m), z the
/// nearer one, are alike.
struct NearerLaw {
  float least_sigmas = 0.0F;
  float sigma_per_m2 = 0.0F;
  float sigma_floor_m = 0.0F;
};

/// Which of two rows of depths (metres, 0 = nothing there) holds the nearer surface, or the only
/// one: 1 the first, -1 the second, 0 they are alike. Of `first`, `second` and `side` kNearerPad
/// elements more may be read or written.
inline constexpr std::size_t kNearerPad = 8;
void nearer_row(const float* first, const float* second, std::size_t count, const NearerLaw& law,
                std::int8_t* side) noexcept;

namespace reference {
void nearer_row(const float* first, const float* second, std::size_t count, const NearerLaw& law,
                std::int8_t* side) noexcept;
}  // namespace reference

}  // namespace grapnel::kernels
