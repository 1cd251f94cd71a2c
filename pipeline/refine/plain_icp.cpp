#include "pipeline/refine/plain_icp.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string_view>

#include "pipeline/coarse/kabsch.h"
#include "pipeline/refine/normal_equations.h"
#include "pipeline/refine/point_step.h"

namespace grapnel {
namespace {

constexpr std::array<std::string_view, 2> kMetrics = {"point_to_point", "point_to_plane"};
constexpr std::uint32_t kFewestPartners = 3;  // as PCL
constexpr double kAbsoluteMse = 1e-12;        // PCL's default

struct Sums {
  PointPairSums points;
  Mat6d matrix = Mat6d::Zero();
  Vec6d gradient = Vec6d::Zero();
  double square_sum = 0.0;
  std::uint32_t count = 0;
};

Pose step_of(const Sums& sums, bool plane, bool& solved) noexcept {
  solved = true;
  if (!plane) return best_rigid_motion(sums.points);
  const Eigen::LDLT<Mat6d> factor(sums.matrix);
  const Vec6d step = -factor.solve(sums.gradient);
  solved = step.allFinite();
  return solved ? moved(Pose::Identity(), step, Vec3d::Zero()) : Pose::Identity();
}

}  // namespace

FieldTable plain_icp_fields() noexcept {
  using P = PlainIcpParams;
  static constexpr std::array kFields = {
      choice_field<&P::metric>("metric", kMetrics, "error that is made small"),
      number_field<&P::max_iterations>("max_iterations", "", 1, 1000, "iterations at the most"),
      number_field<&P::max_points>("max_points", "", 0, 200000,
                                   "points of the moving surface used; 0 = all"),
      number_field<&P::max_distance_m>("max_distance_m", "m", 0.0, 100.0,
                                       "of partners; 0 = max_distance_ratio spacings"),
      number_field<&P::max_distance_ratio>("max_distance_ratio", "spacings", 0.5, 1000.0,
                                           "of partners"),
      number_field<&P::transformation_epsilon_m2>("transformation_epsilon_m2", "m²", 0.0, 1.0,
                                                  "squared translation of a step that ends"),
      number_field<&P::min_rotation_cos>("min_rotation_cos", "", -1.0, 1.0,
                                         "cosine of a step's angle above which it ends"),
      number_field<&P::relative_mse>("relative_mse", "", 0.0, 1.0,
                                     "relative change of the mean square below which it ends"),
  };
  return kFields;
}

Result<RefinedPose> PlainIcp::refine(const Surface& moving, const Surface& fixed,
                                     const ClosestSurface& closest,
                                     const Pose& fixed_from_moving) noexcept {
  const bool plane = params_.metric == PlainIcpParams::Metric::PointToPlane;
  const double reach_m = params_.max_distance_m > 0.0
                             ? params_.max_distance_m
                             : params_.max_distance_ratio * fixed.spacing_m;
  const std::size_t stride = point_step(moving.size, params_.max_points);
  RefinedPose result;
  result.target_from_source = fixed_from_moving;
  double mse_before = std::numeric_limits<double>::max();
  for (int iteration = 0; iteration < params_.max_iterations && !result.converged; ++iteration) {
    const Pose pose = result.target_from_source;
    Sums sums;
    for (std::size_t i = 0; i < moving.size; i += stride) {
      const Vec3d x = pose * moving.point(i).cast<double>();
      const std::int32_t found = closest.closest(x.cast<float>(), static_cast<float>(reach_m));
      if (found < 0) continue;
      const auto partner = static_cast<std::size_t>(found);
      const Vec3d q = fixed.point(partner).cast<double>();
      // The normals say what the partners fix, whichever error is made small.
      const Vec3d n = fixed.normal(partner).cast<double>();
      Vec6d j;
      j << n, x.cross(n);
      sums.matrix += j * j.transpose();
      if (plane) {
        sums.gradient += j * n.dot(x - q);
      } else {
        sums.points.add(x, q);
      }
      sums.square_sum += (x - q).squaredNorm();
      ++sums.count;
    }
    result.partners = sums.count;
    if (sums.count < kFewestPartners) {
      return Error{Code::RefinementDiverged, Stage::Refine, static_cast<std::int32_t>(sums.count)};
    }
    bool solved = false;
    const Pose step = step_of(sums, plane, solved);
    if (!solved) return Error{Code::RefinementDiverged, Stage::Refine, 0};
    const double mse = sums.square_sum / static_cast<double>(sums.count);
    result.rmse_m = std::sqrt(mse);
    result.information = sums.matrix;
    result.iterations = static_cast<std::uint32_t>(iteration) + 1;
    result.target_from_source = step * pose;
    const double cos_angle = 0.5 * (step.linear().trace() - 1.0);
    const bool still = cos_angle >= params_.min_rotation_cos &&
                       step.translation().squaredNorm() <= params_.transformation_epsilon_m2;
    const bool settled = std::fabs(mse - mse_before) < kAbsoluteMse ||
                         std::fabs(mse - mse_before) / mse_before < params_.relative_mse;
    result.converged = still || settled;
    mse_before = mse;
  }
  if (!result.target_from_source.matrix().allFinite()) {
    return Error{Code::RefinementDiverged, Stage::Refine, 0};
  }
  return result;
}

}  // namespace grapnel
