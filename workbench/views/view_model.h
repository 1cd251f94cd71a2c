#pragma once

#include <vector>

#include "workbench/teach/fused_model.h"
#include "workbench/views/common_frame.h"

namespace grapnel {

/// The samples of the views that are connected to the first one, with their poses.
[[nodiscard]] std::vector<TaughtView> taught_views(const std::vector<View>& views,
                                                   const CommonFrame& frame);

/// Median of the views' distances between neighbouring readings.
[[nodiscard]] double views_sampling_m(const std::vector<View>& views);

}  // namespace grapnel
