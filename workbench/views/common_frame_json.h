#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "workbench/views/common_frame.h"

namespace grapnel {

/// "tree", "loop", "switched_off" or "rejected".
[[nodiscard]] const char* fate_name(EdgeFate fate) noexcept;

/// One sentence a view that is not connected to the first one, empty when all are.
[[nodiscard]] std::vector<std::string> reasons_of(const std::vector<View>& views,
                                                  const CommonFrame& frame);

/// status, code, reasons, views, edges and loops.
[[nodiscard]] nlohmann::ordered_json common_frame_json(const std::vector<View>& views,
                                                       const CommonFrame& frame);

/// The same for a person, in lines.
[[nodiscard]] std::string common_frame_text(const std::vector<View>& views,
                                            const CommonFrame& frame);

}  // namespace grapnel
