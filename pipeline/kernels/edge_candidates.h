#pragma once

#include <cstddef>
#include <cstdint>

namespace grapnel::kernels {

/// The least step in depth that is an edge at depth z: 8 · max(sigma_per_m2 · z², sigma_floor_m),
/// which noise does not explain, and 6 z / fx, which a surface tilted by 80 degrees does not.
struct EdgeLaw {
  float metres_per_unit = 0.001F;
  float sigma_per_m2 = 0.0F;
  float sigma_floor_m = 0.0F;
  float fx = 1.0F;
};
[[nodiscard]] inline float edge_step_m(const EdgeLaw& law, float z_m) noexcept {
  const float sigma_m = law.sigma_per_m2 * z_m * z_m;
  return 8.0F * (sigma_m > law.sigma_floor_m ? sigma_m : law.sigma_floor_m) + 6.0F * z_m / law.fx;
}

/// A stretch of a depth image's row: counts, 0 = no reading, and labels, 0 = background; without
/// labels (null) all is foreground. The rows before and after lie a stride of elements away; they
/// and the row hold an element before the first and behind the last.
struct LabelledRow {
  const std::uint16_t* depth = nullptr;
  std::ptrdiff_t depth_stride = 0;
  const std::uint8_t* label = nullptr;
  std::ptrdiff_t label_stride = 0;
};

inline constexpr std::size_t kCandidatePad = 8;

/// Positions of the foreground's readings that may lie at an edge: one of their four neighbours has
/// no reading, is background or lies a step behind. `found` holds count + kCandidatePad. Returns
/// their number.
std::size_t edge_candidates(const LabelledRow& row, std::size_t count, const EdgeLaw& law,
                            std::int32_t* found) noexcept;

namespace reference {
std::size_t edge_candidates(const LabelledRow& row, std::size_t count, const EdgeLaw& law,
                            std::int32_t* found) noexcept;
}  // namespace reference

}  // namespace grapnel::kernels
