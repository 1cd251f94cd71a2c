#pragma once

#include <cstddef>
#include <cstdint>

namespace grapnel::kernels {

/// Pixels that a depth kernel may read behind the last one of a padded row.
inline constexpr std::size_t kDepthSlack = 16;

/// Median of one row. `rows` are `window` (3 or 5) padded rows around it: each starts window/2
/// pixels left of the first output pixel and has zeros outside the image and kDepthSlack readable
/// pixels behind. Only readings (not 0) count; of an even number the upper middle one; an output
/// whose own reading is 0 is 0.
void median_row(const std::uint16_t* const* rows, int window, std::size_t width,
                std::uint16_t* out) noexcept;

/// Allowed step in counts at depth d: 1 + floor(d (linear + quadratic d)).
struct GapLaw {
  float linear = 0.0F;
  float quadratic = 0.0F;
};

/// One row of the support test. `above`, `row` and `below` are padded as for median_row with window
/// 3. Readings with fewer than `min_support` of their eight neighbours within the gap become 0.
/// Returns how many that were.
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
