#pragma once

#include <cstddef>
#include <cstdint>

#include "pipeline/kernels/depth_rows.h"

namespace grapnel::kernels {

/// Median of one row. `rows` are `window` (3 or 5) padded rows around it: each starts window/2
/// pixels left of the first output pixel and has zeros outside the image and kDepthSlack readable
/// pixels behind. Only readings (not 0) count; of an even number the upper middle one; an output
/// whose own reading is 0 is 0.
void median_row(const std::uint16_t* const* rows, int window, std::size_t width,
                std::uint16_t* out) noexcept;

}  // namespace grapnel::kernels
