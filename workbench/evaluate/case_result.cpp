#include "workbench/evaluate/case_result.h"

#include <exception>
#include <filesystem>

#include "base/input_error.h"
#include "pipeline/registrar.h"
#include "workbench/evaluate/consistency.h"
#include "workbench/evaluate/many_case.h"

namespace grapnel {
namespace {

void judge(const Suite& suite, const SuiteCase& one, const Job& job, CaseResult& result) {
  const RegistrationReport& report = result.answer.report;
  if (!one.truth || !report.has_pose) return;
  result.error =
      pose_error(report.target_from_source, *one.truth, job.symmetry(), job.source_points());
  result.right = result.error->mean_displacement_m <= suite.tolerance_m &&
                 result.error->rotation_rad <= suite.tolerance_rad;
  if (!result.right) return;
  result.nees = normalised_squared_errors(report.target_from_source, result.error->nearest_truth,
                                          report.covariance, job.symmetry(), job.source_points());
}

nlohmann::ordered_json view_json(const ViewResult& view) {
  nlohmann::ordered_json json;
  json["connected"] = view.connected;
  if (view.connected) json["transform"] = pose_json(view.first_from_view);
  if (view.error) {
    json["error_m"] = view.error->mean_displacement_m;
    json["error_rad"] = view.error->rotation_rad;
  }
  return json;
}

}  // namespace

std::string general_preset(CaseKind kind) { return kind == CaseKind::Scene ? "object" : "pair"; }

JobInputs inputs_of(const SuiteCase& one) {
  JobInputs inputs;
  inputs.kind = one.kind == CaseKind::Scene ? RegistrationKind::Object : RegistrationKind::Pair;
  inputs.source = one.source;
  inputs.target = one.target;
  inputs.source_options = {one.camera, one.source_color};
  inputs.target_options = {one.camera, one.color};
  inputs.symmetry = one.symmetry;
  inputs.initial = one.initial;
  return inputs;
}

CaseResult run_case(const Suite& suite, const SuiteCase& one, const std::string& preset,
                    RegistrarStore& store, const std::vector<std::string>& overrides) {
  CaseResult result;
  result.id = one.id;
  result.group = one.group;
  result.kind = one.kind;
  result.expect = one.expect;
  result.preset = preset;
  try {
    if (one.kind == CaseKind::Many) {
      run_many_case(suite, one, preset == "default" ? general_preset(one.kind) : preset, result);
      return result;
    }
    Job job(inputs_of(one), preset == "default" ? general_preset(one.kind) : preset, overrides,
            &store);
    result.answer = job.run();
    judge(suite, one, job, result);
  } catch (const InputError& error) {
    result.answer = failed_answer(Code::FileUnreadable, error.what());
  } catch (const std::exception& error) {
    result.answer = failed_answer(Code::InternalFault, error.what());
  }
  return result;
}

nlohmann::ordered_json to_json(const CaseResult& result) {
  nlohmann::ordered_json json;
  json["id"] = result.id;
  json["preset"] = result.preset;
  json["kind"] = kind_name(result.kind);
  json["expect"] = expect_name(result.expect);
  if (!result.group.empty()) json["group"] = result.group;
  json.update(to_json(result.answer));
  json["error_m"] = result.error ? nlohmann::ordered_json(result.error->mean_displacement_m)
                                 : nlohmann::ordered_json(nullptr);
  json["error_rad"] = result.error ? nlohmann::ordered_json(result.error->rotation_rad)
                                   : nlohmann::ordered_json(nullptr);
  json["right"] = result.right;
  if (result.nees) json["nees"] = *result.nees;
  for (const ViewResult& view : result.views) json["views"].push_back(view_json(view));
  return json;
}

}  // namespace grapnel
