#include "workbench/evaluate/case_pictures.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <optional>

#include "base/input_error.h"
#include "workbench/picture/job_picture.h"

namespace grapnel {
namespace {

/// Outcomes that are drawn in turn.
constexpr std::size_t kOutcomes = 6;

std::size_t outcome_of(const CaseResult& result) {
  if (result.false_accept()) return 0;
  if (result.expect == Expect::Accept) return result.accepted() ? 3 : 1;
  if (result.expect == Expect::Either) return result.accepted() ? 4 : 2;
  return 5;
}

/// The worst of each outcome in turn; every false accept comes first.
std::vector<std::size_t> drawn_order(const std::vector<CaseResult>& results) {
  std::array<std::vector<std::size_t>, kOutcomes> by_outcome;
  for (const std::size_t i : worst_first(results)) {
    if (!results[i].failed() && results[i].kind != CaseKind::Many) {
      by_outcome[outcome_of(results[i])].push_back(i);
    }
  }
  std::vector<std::size_t> order = by_outcome[0];
  for (std::size_t turn = 0; order.size() < results.size(); ++turn) {
    const std::size_t before = order.size();
    for (std::size_t outcome = 1; outcome < kOutcomes; ++outcome) {
      if (turn < by_outcome[outcome].size()) order.push_back(by_outcome[outcome][turn]);
    }
    if (order.size() == before) break;
  }
  return order;
}

RgbImage draw_case(const CaseResult& result, const SuiteCase& one, int panel_px) {
  const JobInputs inputs = inputs_of(one);
  const Input target = load_input(inputs.target, inputs.target_options);
  std::optional<Model> model;
  std::optional<Input> source;
  if (inputs.kind == RegistrationKind::Object) {
    model = load_model(inputs.source);
  } else {
    source = load_input(inputs.source, inputs.source_options);
  }
  std::vector<Pose> found;
  const RegistrationReport& report = result.answer.report;
  if (report.has_pose) found.push_back(report.target_from_source);
  DrawnJob job{&target, model ? &*model : nullptr, source ? &*source : nullptr};
  if (report.has_rival) job.rival = report.target_from_rival;
  PictureParams params;
  params.panel_px = panel_px;
  return draw_job(job, found, one.truth, params);
}

}  // namespace

int rank_of(const CaseResult& result) noexcept {
  if (result.false_accept()) return 0;
  if (result.failed()) return 1;
  if (result.expect == Expect::Accept && !result.accepted()) return 2;
  return 3;
}

std::vector<std::size_t> worst_first(const std::vector<CaseResult>& results) {
  const auto error_m = [&](std::size_t i) {
    return results[i].error ? results[i].error->mean_displacement_m : 0.0;
  };
  std::vector<std::size_t> order(results.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    const int rank_a = rank_of(results[a]);
    const int rank_b = rank_of(results[b]);
    return rank_a != rank_b ? rank_a < rank_b : error_m(a) > error_m(b);
  });
  return order;
}

std::vector<CasePicture> draw_cases(const std::vector<CaseResult>& results,
                                    const std::vector<const SuiteCase*>& case_of, std::size_t count,
                                    int panel_px) {
  std::vector<CasePicture> pictures;
  for (const std::size_t i : drawn_order(results)) {
    if (pictures.size() == count) break;
    try {
      RgbImage image = draw_case(results[i], *case_of[i], panel_px);
      if (!image.empty()) pictures.push_back({i, std::move(image)});
    } catch (const InputError&) {
      // Gone since it was run: the report says so by its absence.
      continue;
    }
  }
  return pictures;
}

}  // namespace grapnel
