#include "firmware_app/plc_object.h"

#include <algorithm>

namespace grapnel {
namespace {

// Less of the model's whole surface than this was confirmed: worth a note to the integrator.
constexpr double kLowCoverage = 0.2;

}  // namespace

std::uint32_t reason_bits(const RegistrationReport& report) noexcept {
  std::uint32_t bits = 0;
  for (const Reason& reason : report.reasons) {
    const unsigned offset = static_cast<unsigned>(reason.code()) - 1000U;
    if (offset < 32U) bits |= 1U << offset;
  }
  return bits;
}

PlcObject to_plc_object(const RegistrationReport& report, const JobProfile& profile,
                        bool camera_frame, std::uint16_t extra_quality) noexcept {
  PlcObject object;
  object.accepted = report.accepted;
  object.surface_grasp = report.surface_grasp;
  object.code = report.code;
  object.reasons = reason_bits(report);
  object.fitness = report.fitness;
  object.rmse_m = report.rmse_m;
  object.coverage = report.coverage;
  object.margin = report.margin;
  object.free_space_violation = report.free_space_violation;
  object.sigma_m = report.sigma_m;
  object.sigma_rad = report.sigma_rad;
  object.quality_score =
      static_cast<std::uint16_t>(std::clamp(report.quality, 0.0, 1.0) * 1000.0 + 0.5);
  unsigned quality = extra_quality;
  if (report.symmetric) quality |= kQualitySymmetric;
  if (report.coverage < kLowCoverage) quality |= kQualityLowCoverage;
  if (report.budget_reached) quality |= kQualityBudgetReached;
  object.quality_bits = static_cast<std::uint16_t>(quality);

  const bool to_robot = profile.calibrated && !camera_frame;
  object.frame = to_robot ? PoseFrame::RobotBase : PoseFrame::Camera;
  if (report.model >= profile.models.size()) return object;
  const ModelProfile& model = profile.models[report.model];
  object.model_id = model.id;
  object.pick_point_id = report.surface_grasp ? std::uint16_t{0} : model.grasp_id;
  const Pose camera_from_grasp = report.surface_grasp
                                     ? report.target_from_grasp
                                     : report.target_from_source * model.model_from_grasp;
  const Pose camera_from_pick = camera_from_grasp * model.grasp_from_pick;
  object.frame_from_grasp =
      to_robot ? profile.robot_from_camera * camera_from_pick : camera_from_pick;
  return object;
}

}  // namespace grapnel
