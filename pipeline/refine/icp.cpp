#include "pipeline/refine/icp.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

#include "base/math.h"
#include "pipeline/coarse/kabsch.h"
#include "pipeline/refine/normal_equations.h"

namespace grapnel {
namespace {

constexpr std::array<std::string_view, 2> kMetrics = {"point_to_plane", "point_to_point"};
constexpr std::uint32_t kFewestPartners = 12;

struct Partners {
  NormalEquations planes;
  PointPairSums points;
  double square_sum = 0.0;
  std::uint32_t count = 0;
};

struct Gate {
  double distance_m = 0.0;
  double kernel_m = 0.0;
  double cos_normal = 0.0;
};

/// Collects the partners of every `step`-th moving point at this pose.
void pair_up(const Surface& moving, const Surface& fixed, const ClosestSurface& closest,
             const Pose& pose, std::size_t step, const Gate& gate, bool plane,
             Partners& partners) noexcept {
  const Eigen::Matrix3f rotation = pose.linear().cast<float>();
  const Vec3f shift = pose.translation().cast<float>();
  const double kernel_square = gate.kernel_m * gate.kernel_m;
  for (std::size_t i = 0; i < moving.size; i += step) {
    const Vec3f x = rotation * moving.point(i) + shift;
    const std::int32_t found = closest.closest(x, static_cast<float>(gate.distance_m));
    if (found < 0) continue;
    const auto partner = static_cast<std::size_t>(found);
    if (!fixed.has_normal(partner)) continue;
    const Vec3f normal = fixed.normal(partner);
    if (moving.has_normal(i) &&
        (rotation * moving.normal(i)).dot(normal) < static_cast<float>(gate.cos_normal)) {
      continue;
    }
    const Vec3d xd = x.cast<double>();
    const Vec3d q = fixed.point(partner).cast<double>();
    const double residual = normal.cast<double>().dot(xd - q);
    const double error_square = plane ? residual * residual : (xd - q).squaredNorm();
    const double root = kernel_square / (kernel_square + error_square);
    const double weight = root * root;
    if (plane) {
      partners.planes.add(normal.cast<double>(), xd, residual, weight);
    } else {
      partners.points.add(xd, q, weight);
    }
    partners.square_sum += error_square;
    ++partners.count;
  }
}

Vec3d centre_of(const Surface& surface) noexcept {
  Vec3d sum = Vec3d::Zero();
  for (std::size_t i = 0; i < surface.size; ++i) sum += surface.point(i).cast<double>();
  return surface.size == 0 ? sum : Vec3d(sum / static_cast<double>(surface.size));
}

}  // namespace

FieldTable icp_fields() noexcept {
  using P = IcpParams;
  static constexpr std::array kFields = {
      choice_field<&P::metric>("metric", kMetrics, "error that is made small"),
      number_field<&P::max_iterations>("max_iterations", "", 1, 500, "iterations at the most"),
      number_field<&P::max_points>("max_points", "", 32, 200000,
                                   "points of the moving surface used"),
      number_field<&P::start_distance_ratio>("start_distance_ratio", "spacings", 0.5, 1000.0,
                                             "partners' distance limit at first"),
      number_field<&P::end_distance_ratio>("end_distance_ratio", "spacings", 0.5, 1000.0,
                                           "partners' distance limit at last"),
      number_field<&P::anneal_iterations>("anneal_iterations", "", 0, 500,
                                          "iterations from the first limit to the last"),
      number_field<&P::max_normal_angle_rad>("max_normal_angle_rad", "rad", 0.05, 3.2,
                                             "partners' normals differ by at most this"),
      number_field<&P::convergence_m>("convergence_m", "m", 0.0, 0.01,
                                      "a shorter step ends the iterations"),
      number_field<&P::convergence_rad>("convergence_rad", "rad", 0.0, 0.1,
                                        "a smaller turn ends the iterations"),
      number_field<&P::freeze_ratio>(
          "freeze_ratio", "", 0.0, 0.5,
          "directions with a smaller share of the largest eigenvalue stay"),
  };
  return kFields;
}

Result<RefinedPose> Icp::refine(const Surface& moving, const Surface& fixed,
                                const ClosestSurface& closest,
                                const Pose& fixed_from_moving) noexcept {
  const bool plane = params_.metric == IcpParams::Metric::PointToPlane;
  const double start_m = params_.start_distance_ratio * fixed.spacing_m;
  const double end_m = std::min(start_m, params_.end_distance_ratio * fixed.spacing_m);
  const double shrink =
      params_.anneal_iterations < 1
          ? 0.0
          : math::exp(math::log(end_m / start_m) / static_cast<double>(params_.anneal_iterations));
  const std::size_t step = std::max<std::size_t>(
      1, (moving.size + params_.max_points - 1) / std::max<std::size_t>(1, params_.max_points));
  const Vec3d centre = centre_of(moving);

  RefinedPose result;
  result.target_from_source = fixed_from_moving;
  Gate gate{start_m, 0.0, math::cos(params_.max_normal_angle_rad)};
  for (int iteration = 0; iteration < params_.max_iterations; ++iteration) {
    gate.kernel_m = 0.5 * gate.distance_m;
    const Pose& pose = result.target_from_source;
    Partners partners{NormalEquations(pose * centre), {}, 0.0, 0};
    pair_up(moving, fixed, closest, pose, step, gate, plane, partners);
    if (partners.count < kFewestPartners) {
      return Error{Code::RefinementDiverged, Stage::Refine,
                   static_cast<std::int32_t>(partners.count)};
    }
    result.partners = partners.count;
    result.rmse_m = std::sqrt(partners.square_sum / static_cast<double>(partners.count));
    result.iterations = static_cast<std::uint32_t>(iteration) + 1;
    double shift_m = 0.0;
    double turn_rad = 0.0;
    if (plane) {
      const Vec6d update = partners.planes.solve(params_.freeze_ratio);
      result.information = partners.planes.information_at_origin();
      result.target_from_source = moved(pose, update, partners.planes.centre());
      shift_m = update.head<3>().norm();
      turn_rad = update.tail<3>().norm();
    } else {
      const Pose update = best_rigid_motion(partners.points);
      shift_m = (update * (pose * centre) - pose * centre).norm();
      turn_rad = rotation_angle_rad(update, Pose::Identity());
      result.target_from_source = update * pose;
    }
    const bool annealed = gate.distance_m <= end_m * 1.0001;
    result.converged =
        annealed && shift_m <= params_.convergence_m && turn_rad <= params_.convergence_rad;
    if (result.converged) break;
    gate.distance_m = std::max(end_m, gate.distance_m * shrink);
  }
  if (!result.target_from_source.matrix().allFinite()) {
    return Error{Code::RefinementDiverged, Stage::Refine, 0};
  }
  return result;
}

}  // namespace grapnel
