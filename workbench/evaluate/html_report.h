#pragma once

#include <nlohmann/json.hpp>
#include <span>
#include <string>

#include "workbench/evaluate/case_result.h"

namespace grapnel {

/// report.html: one page that needs nothing else. A table of the presets, the codes, and the worst
/// cases: false accepts first, then positives that were rejected, then the largest errors.
[[nodiscard]] std::string html_report(const nlohmann::ordered_json& summary,
                                      std::span<const CaseResult> results);

}  // namespace grapnel
