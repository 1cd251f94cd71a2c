#pragma once

#include <nlohmann/json.hpp>

#include "workbench/evaluate/case_result.h"

namespace grapnel {

/// What summaries need of a line of results.jsonl: the inverse of to_json() but for poses, views
/// and the list of objects. Throws nlohmann::json::exception or InputError when a key lacks or
/// holds something else.
[[nodiscard]] CaseResult stored_result(const nlohmann::json& line);

}  // namespace grapnel
