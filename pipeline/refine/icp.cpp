#include "pipeline/refine/icp.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

#include "base/math.h"
#include "pipeline/coarse/kabsch.h"
#include "pipeline/kernels/surface_pairs.h"
#include "pipeline/refine/normal_equations.h"
#include "pipeline/refine/point_blocks.h"
#include "pipeline/refine/point_step.h"

namespace grapnel {
namespace {

constexpr std::array<std::string_view, 3> kMetrics = {"point_to_plane", "point_to_point",
                                                      "symmetric"};
constexpr std::uint32_t kFewestPartners = 12;

struct Partners {
  NormalEquations planes;
  PointPairSums points;  ///< less the centre
  double square_sum = 0.0;
  std::uint32_t count = 0;
};

void add_points(const kernels::PointBlock& block, const kernels::OrientedPlanes& fixed,
                const kernels::PairGate& gate, Partners& partners) noexcept {
  kernels::PointSums parts{};
  kernels::add_point_pairs(block, fixed, gate, parts);
  partners.points.weight += sum_of(parts.sum[0]);
  for (int a = 0; a < 3; ++a) {
    partners.points.source[a] += sum_of(parts.sum[1 + a]);
    partners.points.target[a] += sum_of(parts.sum[4 + a]);
    for (int b = 0; b < 3; ++b) partners.points.cross(a, b) += sum_of(parts.sum[7 + 3 * a + b]);
  }
  partners.square_sum += sum_of(parts.sum[16]);
  partners.count += static_cast<std::uint32_t>(sum_of(parts.sum[17]));
}

struct Look {
  bool plane = true;    ///< error along normals
  bool nearest = true;  ///< else a near point will do
};

/// Collects the partners of every `step`-th moving point at this pose.
void pair_up(const Surface& moving, const Surface& fixed, const ClosestSurface& closest,
             const Pose& pose, std::size_t step, const kernels::PairGate& gate, const Look& look,
             Partners& partners) noexcept {
  const kernels::Motion motion = kernels::motion_of(pose);
  const kernels::OrientedPlanes surface = planes_of(fixed);
  const kernels::OrientedPlanes points = planes_of(moving);
  const float max_distance_m = std::sqrt(gate.max_square_m2);
  kernels::PointBlock block;
  for (std::size_t first = 0; first < moving.size;) {
    first = take_block(points, moving.size, first, step, block);
    kernels::move_block(motion, block);
    if (look.nearest) {
      closest.closest_of_each(block.x, block.y, block.z, block.size, max_distance_m, block.partner);
    } else {
      closest.nearby_of_each(block.x, block.y, block.z, block.size, max_distance_m, block.partner);
    }
    std::fill(block.partner + block.size, block.partner + kernels::in_lanes(block.size), -1);
    if (look.plane) {
      const PlanePairs pairs = add_plane_pairs(block, surface, gate, partners.planes);
      partners.square_sum += pairs.square_m2;
      partners.count += pairs.count;
    } else {
      add_points(block, surface, gate, partners);
    }
  }
}

/// Middle of every `step`-th point.
Vec3d middle_of(const Surface& surface, std::size_t step) noexcept {
  Vec3d sum = Vec3d::Zero();
  double count = 0.0;
  for (std::size_t i = 0; i < surface.size; i += step) {
    sum += surface.point(i).cast<double>();
    count += 1.0;
  }
  return count > 0.0 ? Vec3d(sum / count) : sum;
}

Vec3d centre_of(const kernels::PairGate& gate) noexcept {
  return {static_cast<double>(gate.centre[0]), static_cast<double>(gate.centre[1]),
          static_cast<double>(gate.centre[2])};
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
  const bool plane = params_.metric != IcpParams::Metric::PointToPoint;
  const double start_m = params_.start_distance_ratio * fixed.spacing_m;
  const double end_m = std::min(start_m, params_.end_distance_ratio * fixed.spacing_m);
  const double shrink =
      params_.anneal_iterations < 1
          ? 0.0
          : math::exp(math::log(end_m / start_m) / static_cast<double>(params_.anneal_iterations));
  const std::size_t step = point_step(moving.size, params_.max_points);
  const Vec3d centre = middle_of(moving, step);

  RefinedPose result;
  result.target_from_source = fixed_from_moving;
  double distance_m = start_m;
  kernels::PairGate gate;
  gate.cos_normal = static_cast<float>(math::cos(params_.max_normal_angle_rad));
  gate.symmetric = params_.metric == IcpParams::Metric::Symmetric;
  for (int iteration = 0; iteration < params_.max_iterations; ++iteration) {
    const Pose& pose = result.target_from_source;
    const Vec3d middle = pose * centre;
    gate.max_square_m2 = static_cast<float>(distance_m * distance_m);
    gate.kernel_square_m2 = 0.25F * gate.max_square_m2;
    for (int axis = 0; axis < 3; ++axis) gate.centre[axis] = static_cast<float>(middle[axis]);
    const Vec3d rounded = centre_of(gate);
    Partners partners{NormalEquations(rounded), {}, 0.0, 0};
    const bool annealed = distance_m <= end_m * 1.0001;
    const bool last = iteration + 1 == params_.max_iterations;
    pair_up(moving, fixed, closest, pose, step, gate, {plane, annealed || last}, partners);
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
      const Pose update = Eigen::Translation3d(rounded) * best_rigid_motion(partners.points) *
                          Eigen::Translation3d(-rounded);
      shift_m = (update * middle - middle).norm();
      turn_rad = rotation_angle_rad(update, Pose::Identity());
      result.target_from_source = update * pose;
    }
    result.converged =
        annealed && shift_m <= params_.convergence_m && turn_rad <= params_.convergence_rad;
    if (result.converged) break;
    distance_m = std::max(end_m, distance_m * shrink);
  }
  if (!result.target_from_source.matrix().allFinite()) {
    return Error{Code::RefinementDiverged, Stage::Refine, 0};
  }
  if (!plane) {
    // The closed form says nothing of what the partners fix; their normals do.
    Partners met{NormalEquations(centre_of(gate)), {}, 0.0, 0};
    pair_up(moving, fixed, closest, result.target_from_source, step, gate, {}, met);
    result.information = met.planes.information_at_origin();
  }
  return result;
}

}  // namespace grapnel
