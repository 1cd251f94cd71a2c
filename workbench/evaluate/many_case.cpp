#include "workbench/evaluate/many_case.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "base/clock.h"
#include "workbench/views/common_frame.h"
#include "workbench/views/common_frame_json.h"

namespace grapnel {
namespace {

constexpr std::size_t kErrorPoints = 2000;

std::vector<View> views_of(const SuiteCase& one) {
  std::vector<View> views;
  for (const SuiteView& view : one.views) {
    ViewOptions options;
    options.input = {view.camera.empty() ? one.camera : view.camera, view.color};
    if (!view.mask.empty()) options.masks = {view.mask};
    std::vector<View> loaded = load_views({view.source}, options);
    views.push_back(std::move(loaded.front()));
  }
  return views;
}

/// Pairs that carry or confirm a view, the worst of each figure.
Answer answer_of(const std::vector<View>& views, const CommonFrame& frame) {
  Answer answer;
  answer.status = frame.complete() ? Answer::Status::Accepted : Answer::Status::Rejected;
  answer.code = frame.complete() ? Code::ObjectFound : Code::NoObjectAccepted;
  answer.reasons = reasons_of(views, frame);
  RegistrationReport& report = answer.report;
  report.accepted = frame.complete();
  report.code = answer.code;
  bool first = true;
  for (const ViewEdge& edge : frame.edges) {
    answer.peak_bytes = std::max(answer.peak_bytes, edge.answer.peak_bytes);
    if (edge.fate != EdgeFate::Tree && edge.fate != EdgeFate::Loop) continue;
    const RegistrationReport& pair = edge.answer.report;
    const auto least = [&](double value, double other) {
      return first ? other : std::min(value, other);
    };
    report.fitness = least(report.fitness, pair.fitness);
    report.coverage = least(report.coverage, pair.coverage);
    report.margin = least(report.margin, pair.margin);
    report.rmse_m = std::max(report.rmse_m, pair.rmse_m);
    report.free_space_violation = std::max(report.free_space_violation, pair.free_space_violation);
    report.sigma_m = std::max(report.sigma_m, pair.sigma_m);
    report.sigma_rad = std::max(report.sigma_rad, pair.sigma_rad);
    first = false;
  }
  answer.seed = frame.edges.empty() ? 0 : frame.edges.front().answer.seed;
  return answer;
}

void judge(const Suite& suite, const SuiteCase& one, const std::vector<View>& views,
           const CommonFrame& frame, CaseResult& result) {
  bool right = true;
  for (std::size_t i = 0; i < views.size(); ++i) {
    ViewResult view;
    view.connected = frame.views[i].connected;
    if (view.connected) view.first_from_view = frame.views[i].part_from_view;
    if (view.connected && one.views[i].truth) {
      const Pose truth = one.views[0].truth->inverse() * *one.views[i].truth;
      view.error = pose_error(view.first_from_view, truth, Symmetry::None,
                              sampled_points(views[i], kErrorPoints));
      right = right && view.error->mean_displacement_m <= suite.tolerance_m &&
              view.error->rotation_rad <= suite.tolerance_rad;
      if (!result.error || view.error->mean_displacement_m > result.error->mean_displacement_m) {
        result.error = view.error;
        result.answer.report.target_from_source = view.first_from_view;
        result.answer.report.has_pose = true;
      }
    }
    right = right && view.error.has_value();
    result.views.push_back(view);
  }
  result.right = right;
}

}  // namespace

void run_many_case(const Suite& suite, const SuiteCase& one, const std::string& preset,
                   CaseResult& result) {
  const std::vector<View> views = views_of(one);
  CommonFrameOptions options;
  options.preset = preset;
  const MonotonicClock clock;
  const std::int64_t begin_us = clock.now_us();
  const CommonFrame frame = bring_together(views, options);
  result.answer = answer_of(views, frame);
  result.answer.total_ms = static_cast<double>(clock.now_us() - begin_us) / 1000.0;
  judge(suite, one, views, frame, result);
}

}  // namespace grapnel
