// What FrameJob asks about the pose that its search found.
#include <algorithm>

#include "pipeline/frame_job.h"
#include "pipeline/judge/resting.h"
#include "pipeline/judge/share_outside.h"
#include "pipeline/judge/verdict.h"

namespace grapnel {
namespace {

// Views of the part that one piece may measure: a part 10 % larger has 1.21, two that touch more.
constexpr double kTouching = 1.3;

}  // namespace

void FrameJob::judge(std::size_t model_i, double floor_m, RegistrationReport& report) noexcept {
  const ModelIndex& model = s_.models[model_i];
  Findings findings;
  findings.diameter_m = model.diameter_m;
  findings.tolerance_m = floor_m;
  findings.closed = model.closed;
  if (!s_.search.candidates().empty()) {
    const Candidate& best = s_.search.candidates()[0];
    const Pose pose =
        canonical_pose(best.refined.target_from_source, s_.grasp[model_i], model.symmetry);
    report.has_pose = true;
    report.target_from_source = pose;
    report.iterations = best.refined.iterations;
    report.converged = best.refined.converged;
    findings.evidence = best.evidence;
    const Margin margin = s_.search.margin(model);
    findings.margin = margin.value;
    report.has_rival =
        margin.rival != nullptr && margin.value < s_.stages.params.verdict.min_margin;
    if (report.has_rival) {
      report.target_from_rival = canonical_pose(*margin.rival, s_.grasp[model_i], model.symmetry);
    }
    const MeasuredObject object = measured();
    look_at_mirror(model, floor_m, findings);
    s_.search.show_best(model, object);
    if (s_.stages.params.verdict.max_left_over > 0.0) {
      findings.left_over_m2 = s_.search.left_over_m2(model, object);
    }
    const auto z_m = static_cast<float>((pose * model.centre).z());
    const double sigma_m = static_cast<double>(view_.noise.sigma_m(z_m));
    findings.tolerance_m = std::max(3.0 * sigma_m, floor_m);
    predict_deviation(model_i, floor_m, report);
    Pose frame = pose * s_.grasp[model_i];
    if (s_.preset.models[model_i].grasps.front().required.empty()) {
      frame.translation() = pose * model.centre;
    }
    const Uncertainty uncertainty = uncertainty_at(report.covariance, frame, s_.required[model_i]);
    findings.sigma_m = uncertainty.sigma_m;
    findings.sigma_rad = uncertainty.sigma_rad;
    findings.outside = share_outside(model.fine, pose, s_.work.intrinsics);
    if (s_.background.plane_count > 0) look_at_ground(model, floor_m, findings);
  }
  pass_verdict(findings, s_.stages.params.verdict, report);
  name_touching(model_i, report);
}

/// The covariance of the report's pose, from the readings that the judge itself compared with it.
void FrameJob::predict_deviation(std::size_t model_i, double floor_m,
                                 RegistrationReport& report) noexcept {
  const ModelIndex& model = s_.models[model_i];
  const Pose& pose = report.target_from_source;
  ReadingSpread spread;
  spread.floor_m = floor_m;
  PoseReadings readings = s_.search.information(model, measured(), spread);
  if (const int axis = free_axis(model.symmetry); axis >= 0) {
    take_turn_as_known(pose.translation(), pose.linear().col(axis), readings.information);
  }
  const GeneralParams& general = s_.stages.params.general;
  report.covariance = pose_covariance(
      readings, {general.common_error_px, general.common_error_px, general.common_error_sigmas});
}

void FrameJob::look_at_ground(const ModelIndex& model, double floor_m,
                              Findings& findings) noexcept {
  const Pose& pose = s_.search.candidates()[0].refined.target_from_source;
  findings.has_belt = true;
  findings.resting =
      rest_on(s_.background.planes[0], model.fine, pose, model.centre, model.diameter_m);
  findings.ground_tolerance_m = std::max(findings.tolerance_m, floor_m);
  findings.ground =
      s_.search.ground_beside(model, measured(), findings.resting, findings.ground_tolerance_m);
}

/// Nobody needs to know of the mirror image of a part that is refused anyway.
void FrameJob::look_at_mirror(const ModelIndex& model, double floor_m,
                              Findings& findings) noexcept {
  const VerdictParams& params = s_.stages.params.verdict;
  if (!(params.min_mirror_margin > 0.0) || model.mirrored.empty()) return;
  if (findings.margin < params.min_margin) return;
  if (s_.search.candidates()[0].worth < least_accepted_worth(params)) return;
  findings.has_mirror = true;
  findings.mirror_margin = s_.search.mirror_margin(model, measured(), floor_m);
}

void FrameJob::look_for_grasp(RegistrationReport& report) const noexcept {
  const ModelIndex& model = s_.models[report.model];
  GraspScene scene;
  scene.work = &s_.work;
  scene.label = group_->label;
  scene.surface = &s_.object.surface;
  if (s_.background.plane_count > 0) scene.belt = &s_.background.planes[0];
  scene.whole = !group_->whole.touches_edge;
  scene.area_m2 = group_->whole.area_m2;
  scene.model_area_m2 = std::max(1e-9, static_cast<double>(model.templates.most_area_m2()));
  scene.model_thickness_m = least_extent_m(model.fine);
  grasp_surface(scene, s_.stages.params.surface_grasp, report);
}

/// A part that fits while the measured piece goes on beside it, or a piece too large for any view
/// of the part: parts touch. A rejection says so first.
void FrameJob::name_touching(std::size_t model_i, RegistrationReport& report) const noexcept {
  const auto most_m2 = static_cast<double>(s_.models[model_i].templates.most_area_m2());
  if (report.accepted || !(most_m2 > 0.0)) return;
  const auto explained = static_cast<double>(report.measured[Check::Explained]);
  const bool fits = report.fitness >= s_.stages.params.verdict.min_fitness && explained > 0.0;
  const double size = fits ? 1.0 / explained : group_->whole.area_m2 / std::max(most_m2, 1e-9);
  if (size > kTouching) reject_for({Check::Size, size, kTouching}, report);
}

}  // namespace grapnel
