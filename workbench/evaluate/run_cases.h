#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "workbench/evaluate/case_result.h"

namespace grapnel {

/// One case by one preset.
struct CaseRun {
  const SuiteCase* one = nullptr;
  std::string preset;                  ///< as run_case() takes it
  std::vector<std::string> overrides;  ///< "key=value"
};

/// Results in the order of the runs, whatever the number of `jobs` at once; `what` names the work
/// where its progress is shown. Never throws for what a run can't read: see run_case().
[[nodiscard]] std::vector<CaseResult> run_cases(const Suite& suite, std::span<const CaseRun> runs,
                                                std::size_t jobs, const std::string& what);

}  // namespace grapnel
