#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "workbench/evaluate/case_pictures.h"
#include "workbench/evaluate/case_result.h"

namespace grapnel {

/// report.html: one page that needs nothing else. Rates with their n and 95 % bounds, for cases and
/// for groups; what the verdict made of right and wrong poses; codes; times; pictures; and the
/// worst cases: false accepts first, then positives that were rejected, then the largest errors.
[[nodiscard]] std::string html_report(const nlohmann::ordered_json& summary,
                                      const std::vector<CaseResult>& results,
                                      const std::vector<CasePicture>& pictures);

}  // namespace grapnel
