#pragma once

#include <vector>

#include "workbench/views/common_frame.h"

namespace grapnel {

/// Every pair of views within reach with its answer, in the order (0,1), (0,2), … The later view is
/// carried onto the earlier one. Throws InputError on a bad preset.
[[nodiscard]] std::vector<ViewEdge> register_pairs(const std::vector<View>& views,
                                                   const CommonFrameOptions& options);

}  // namespace grapnel
