#pragma once

#include <string>

#include "workbench/evaluate/case_result.h"

namespace grapnel {

/// Runs a case of many views into `result`. Its answer is accepted when every view is connected;
/// its figures are the worst of the pairs used, its pose and error those of the worst view relative
/// to the first one. Throws InputError.
void run_many_case(const Suite& suite, const SuiteCase& one, const std::string& preset,
                   CaseResult& result);

}  // namespace grapnel
