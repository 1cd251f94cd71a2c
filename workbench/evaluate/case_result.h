#pragma once

#include <array>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "workbench/answer.h"
#include "workbench/evaluate/pose_error.h"
#include "workbench/evaluate/suite.h"
#include "workbench/job.h"
#include "workbench/registrar_store.h"

namespace grapnel {

/// What became of one view of a case of many.
struct ViewResult {
  bool connected = false;
  Pose first_from_view = Pose::Identity();
  std::optional<PoseError> error;  ///< relative to the first view
};

/// What one preset made of one case.
struct CaseResult {
  std::string id;
  std::string preset;  ///< as summary.json names it
  std::string group;
  CaseKind kind = CaseKind::Pair;
  Expect expect = Expect::Reject;
  Answer answer;
  std::optional<PoseError> error;  ///< where there is a truth and a pose; of many the worst view's
  std::vector<ViewResult> views;   ///< of a case of many
  std::optional<std::array<double, 6>> nees;  ///< of a right pose: normalised_squared_errors()
  bool right = false;                         ///< within both tolerances

  [[nodiscard]] bool accepted() const noexcept { return answer.status == Answer::Status::Accepted; }
  [[nodiscard]] bool failed() const noexcept { return answer.status == Answer::Status::Error; }
  /// Accepted with a wrong pose, or a negative accepted.
  [[nodiscard]] bool false_accept() const noexcept {
    return accepted() && (!right || expect == Expect::Reject);
  }
};

/// The preset of cases that ask for none.
[[nodiscard]] std::string general_preset(CaseKind kind);

/// What a case asks of a job. Precondition: not of kind many.
[[nodiscard]] JobInputs inputs_of(const SuiteCase& one);

/// Runs one case. `preset` "default" takes the general one of the case's kind; `overrides` are not
/// for cases of many. Never throws: what can't be read becomes a result with status error.
[[nodiscard]] CaseResult run_case(const Suite& suite, const SuiteCase& one,
                                  const std::string& preset, RegistrarStore& store,
                                  const std::vector<std::string>& overrides = {});

/// A line of results.jsonl.
[[nodiscard]] nlohmann::ordered_json to_json(const CaseResult& result);

}  // namespace grapnel
