#include "pipeline/coarse/cylinder_axes.h"

#include <array>
#include <cmath>

#include "base/math.h"

namespace grapnel {

FieldTable cylinder_axes_fields() noexcept {
  using P = CylinderAxesParams;
  static constexpr std::array kFields = {
      number_field<&P::trials>("trials", "", 1, 100000, "pairs of points tried"),
      number_field<&P::thickness_ratio>("thickness_ratio", "spacings", 0.01, 100.0,
                                        "half thickness of the wall"),
      number_field<&P::max_normal_angle_rad>("max_normal_angle_rad", "rad", 0.01, 1.5,
                                             "of a point's normal from the radius through it"),
      number_field<&P::min_share>("min_share", "", 0.001, 1.0, "of all points, on the wall"),
      number_field<&P::max_radius_error>("max_radius_error", "", 0.0, 10.0,
                                         "share by which the radii may differ"),
      number_field<&P::turns>("turns", "", 1, 360,
                              "tried about the axis; 1 for a part that is free about it"),
      number_field<&P::ratings>("ratings", "", 1, 1000000, "poses looked at, at most"),
      number_field<&P::quick_samples>("quick_samples", "", 16, 4096, "samples of a first rating"),
  };
  return kFields;
}

Status CylinderAxes::generate(const PairView& pair, const Correspondences&, Rng& rng,
                              Hypotheses& hypotheses) noexcept {
  if (pair.score == nullptr) return Error{Code::BadParameter, Stage::Coarse, 0};
  const CylinderFitParams fit = {params_.trials, params_.thickness_ratio,
                                 params_.max_normal_angle_rad, params_.min_share};
  Cylinder source;
  Cylinder target;
  if (!fit_cylinder(*pair.source, fit, rng.split(1), source) ||
      !fit_cylinder(*pair.target, fit, rng.split(2), target) ||
      std::fabs(source.radius_m - target.radius_m) > params_.max_radius_error * source.radius_m) {
    return Error{Code::NoConsensus, Stage::Coarse, 0};
  }
  finalists_.begin(pair, params_.quick_samples, params_.ratings);
  try_axes(source, target);
  return finalists_.conclude(hypotheses);
}

void CylinderAxes::try_axes(const Cylinder& source, const Cylinder& target) noexcept {
  const Mat3d source_frame = frame_about(source.axis);
  for (const double way : {1.0, -1.0}) {
    const Mat3d target_frame = frame_about(way * target.axis);
    const double low_m = way > 0.0 ? target.low_m : -target.high_m;
    const double high_m = way > 0.0 ? target.high_m : -target.low_m;
    const std::array<double, 3> shifts = {low_m - source.low_m, high_m - source.high_m,
                                          0.5 * (low_m + high_m - source.low_m - source.high_m)};
    for (std::size_t turn = 0; turn < params_.turns; ++turn) {
      const double angle_rad =
          2.0 * math::kPi * static_cast<double>(turn) / static_cast<double>(params_.turns);
      const double c = math::cos(angle_rad);
      const double s = math::sin(angle_rad);
      Mat3d about = Mat3d::Identity();
      about(1, 1) = about(2, 2) = c;
      about(1, 2) = -s;
      about(2, 1) = s;
      Pose pose = Pose::Identity();
      pose.linear() = target_frame * about * source_frame.transpose();
      for (const double shift_m : shifts) {
        pose.translation() =
            target.middle + shift_m * target_frame.col(0) - pose.linear() * source.middle;
        if (!finalists_.offer(pose)) return;
      }
    }
  }
}

}  // namespace grapnel
