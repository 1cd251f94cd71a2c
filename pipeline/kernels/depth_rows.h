#pragma once

#include <cstddef>
#include <cstdint>

namespace grapnel::kernels {

/// Pixels that a depth kernel may read behind the last one of a padded row.
inline constexpr std::size_t kDepthSlack = 16;

/// Allowed step in counts at depth d: 1 + floor(d (linear + quadratic d)).
struct GapLaw {
  float linear = 0.0F;
  float quadratic = 0.0F;
};

/// One row of the support test. `above`, `row` and `below` are padded rows: each starts a
/// pixel left of the first output pixel and has kDepthSlack readable pixels behind. Readings with
/// fewer than `min_support` of their eight neighbours within the gap become 0. Returns how many
/// that were.
std::size_t support_row(const std::uint16_t* above, const std::uint16_t* row,
                        const std::uint16_t* below, const GapLaw& gap, int min_support,
                        std::size_t width, std::uint16_t* out) noexcept;

/// One row of depths to camera coordinates: z = count × metres_per_unit, x = (u - cx)/fx z,
/// y = y_over_z z; zeros stay zero. Outputs have room for kDepthSlack more.
struct RowCamera {
  float metres_per_unit = 0.0F;
  float inverse_fx = 0.0F;
  float cx = 0.0F;
  float y_over_z = 0.0F;
};
void back_project_row(const std::uint16_t* depth, const RowCamera& camera, std::size_t width,
                      float* x, float* y, float* z) noexcept;

}  // namespace grapnel::kernels
