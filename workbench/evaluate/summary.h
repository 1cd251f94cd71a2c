#pragma once

#include <nlohmann/json.hpp>
#include <span>
#include <string>

#include "workbench/evaluate/case_result.h"

namespace grapnel {

/// Counts, rates with their 95 % bounds, errors and times of the results of one preset. A case
/// whose expectation is "either" counts in `cases` and in the accepted_… and rejected_… counts, but
/// is neither a positive nor a negative: recall is of the positives.
[[nodiscard]] nlohmann::ordered_json summarise(std::span<const CaseResult> results);

/// summary.json: one entry a preset, in order of appearance, and what the suite was.
[[nodiscard]] nlohmann::ordered_json summary_of(const Suite& suite,
                                                std::span<const CaseResult> results);

/// A line a preset, on standard output.
void print_summary(const nlohmann::ordered_json& summary);

}  // namespace grapnel
