#include "pipeline/refine/generalized_icp.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>

#include "pipeline/refine/normal_equations.h"
#include "pipeline/refine/point_step.h"

namespace grapnel {
namespace {

constexpr std::uint32_t kFewestPartners = 12;

struct Sums {
  Mat6d matrix = Mat6d::Zero();
  Vec6d gradient = Vec6d::Zero();
  double square_sum = 0.0;
  std::uint32_t count = 0;

  /// A pair `gap` apart, whose moving end lies at `arm` from the centre of the motion.
  void add(const Vec3d& arm, const Vec3d& gap, const Mat3d& weight) noexcept {
    Eigen::Matrix<double, 3, 6> jacobian;
    jacobian.leftCols<3>().setIdentity();
    jacobian.rightCols<3>() = -skew(arm);
    matrix += jacobian.transpose() * weight * jacobian;
    gradient += jacobian.transpose() * (weight * gap);
    square_sum += gap.squaredNorm();
    ++count;
  }
};

/// 1 along the surface, `across` along its normal.
Mat3d spread(const Vec3d& normal, double across) noexcept {
  if (normal.squaredNorm() < 0.5) return Mat3d::Identity();
  return Mat3d::Identity() - (1.0 - across) * normal * normal.transpose();
}

}  // namespace

FieldTable generalized_icp_fields() noexcept {
  using P = GeneralizedIcpParams;
  static constexpr std::array kFields = {
      number_field<&P::max_iterations>("max_iterations", "", 1, 500, "iterations at the most"),
      number_field<&P::max_points>("max_points", "", 0, 200000,
                                   "points of the moving surface used; 0 = all"),
      number_field<&P::max_distance_m>("max_distance_m", "m", 0.0, 100.0,
                                       "of partners; 0 = max_distance_ratio spacings"),
      number_field<&P::max_distance_ratio>("max_distance_ratio", "spacings", 0.5, 1000.0,
                                           "of partners"),
      number_field<&P::intensity_m>("intensity_m", "m", 0.0, 100.0,
                                    "what the range of intensity counts as in the choice of a "
                                    "partner; 0 = by place alone"),
      number_field<&P::normal_variance>("normal_variance", "", 1e-6, 1.0,
                                        "across the surface, where along it is 1"),
      number_field<&P::kernel_ratio>("kernel_ratio", "", 0.0, 100.0,
                                     "scale of the robust weight over max_distance; 0 = none"),
      number_field<&P::convergence_m>("convergence_m", "m", 0.0, 0.01,
                                      "a shorter step ends the iterations"),
      number_field<&P::convergence_rad>("convergence_rad", "rad", 0.0, 0.1,
                                        "a smaller turn ends the iterations"),
  };
  return kFields;
}

void GeneralizedIcp::reserve(Arena& arena, const Limits& limits) {
  if (params_.intensity_m > 0.0) search_.reserve(arena, limits);
}

std::int32_t GeneralizedIcp::partner_of(const Surface& moving, std::size_t moving_i,
                                        const Surface& fixed, const Vec3f& x,
                                        const ClosestSurface& closest, float reach_m) noexcept {
  if (params_.intensity_m <= 0.0) return closest.closest(x, reach_m);
  const Neighbourhood around = search_.within(x, reach_m);
  std::int32_t best = -1;
  double least = 0.0;
  for (std::size_t k = 0; k < around.size(); ++k) {
    const auto other = static_cast<std::size_t>(around.index[k]);
    const double gap_m = params_.intensity_m *
                         static_cast<double>(moving.intensity[moving_i] - fixed.intensity[other]);
    const double squared = static_cast<double>(around.squared_m2[k]) + gap_m * gap_m;
    if (best >= 0 && !(squared < least)) continue;
    least = squared;
    best = around.index[k];
  }
  return best;
}

Result<RefinedPose> GeneralizedIcp::refine(const Surface& moving, const Surface& fixed,
                                           const ClosestSurface& closest,
                                           const Pose& fixed_from_moving) noexcept {
  const double reach_m = params_.max_distance_m > 0.0
                             ? params_.max_distance_m
                             : params_.max_distance_ratio * fixed.spacing_m;
  if (params_.intensity_m > 0.0) {
    if (const Status built = search_.build(fixed, reach_m); !built.ok()) {
      return Error{built.error().code, Stage::Refine, built.error().detail};
    }
  }
  const double kernel_square = params_.kernel_ratio * reach_m * params_.kernel_ratio * reach_m;
  const Vec3d centre = centroid(moving);
  const std::size_t stride = point_step(moving.size, params_.max_points);
  RefinedPose result;
  result.target_from_source = fixed_from_moving;
  for (int iteration = 0; iteration < params_.max_iterations; ++iteration) {
    const Pose pose = result.target_from_source;
    const Vec3d middle = pose * centre;
    Sums sums;
    for (std::size_t i = 0; i < moving.size; i += stride) {
      const Vec3d x = pose * moving.point(i).cast<double>();
      const std::int32_t found =
          partner_of(moving, i, fixed, x.cast<float>(), closest, static_cast<float>(reach_m));
      if (found < 0) continue;
      const auto partner = static_cast<std::size_t>(found);
      const Vec3d gap = x - fixed.point(partner).cast<double>();
      const Vec3d source_normal = pose.linear() * moving.normal(i).cast<double>();
      Mat3d weight = (spread(fixed.normal(partner).cast<double>(), params_.normal_variance) +
                      spread(source_normal, params_.normal_variance))
                         .inverse();
      if (kernel_square > 0.0) {
        const double root = kernel_square / (kernel_square + gap.squaredNorm());
        weight *= root * root;
      }
      sums.add(x - middle, gap, weight);
    }
    result.partners = sums.count;
    if (sums.count < kFewestPartners) {
      return Error{Code::RefinementDiverged, Stage::Refine, static_cast<std::int32_t>(sums.count)};
    }
    result.rmse_m = std::sqrt(sums.square_sum / static_cast<double>(sums.count));
    result.iterations = static_cast<std::uint32_t>(iteration) + 1;
    const Vec6d step = -Eigen::LDLT<Mat6d>(sums.matrix).solve(sums.gradient);
    if (!step.allFinite()) return Error{Code::RefinementDiverged, Stage::Refine, 0};
    Mat6d centre_from_origin = Mat6d::Identity();
    centre_from_origin.topRightCorner<3, 3>() = -skew(middle);
    // In units of one residual across both surfaces, as point to plane has it.
    result.information = 2.0 * params_.normal_variance * centre_from_origin.transpose() *
                         sums.matrix * centre_from_origin;
    result.target_from_source = moved(pose, step, middle);
    result.converged = step.head<3>().norm() <= params_.convergence_m &&
                       step.tail<3>().norm() <= params_.convergence_rad;
    if (result.converged) break;
  }
  if (!result.target_from_source.matrix().allFinite()) {
    return Error{Code::RefinementDiverged, Stage::Refine, 0};
  }
  return result;
}

}  // namespace grapnel
