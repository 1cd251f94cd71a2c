#include "pipeline/refine/contour_fit.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "pipeline/coarse/hypothesis_list.h"
#include "pipeline/refine/normal_equations.h"
#include "pipeline/refine/point_blocks.h"
#include "pipeline/refine/point_step.h"

namespace grapnel {
namespace {

constexpr std::uint32_t kFewestPartners = 12;
constexpr float kCosNormal = 0.6F;
constexpr double kFreezeRatio = 1e-4;
// A motion by less leaves the outline on the same points of the model, pixels of the view.
constexpr double kSamePicture_px = 0.5;

struct Sums {
  NormalEquations equations;
  Vec3d centre;  ///< of the equations, in the model's frame
  double square_m2 = 0.0;
  std::uint32_t partners = 0;
};

double redescend(double residual, double scale) noexcept {
  const double root = scale * scale / (scale * scale + residual * residual);
  return root * root;
}

/// Adds the surface: measured points, carried into the model's frame, on the tangent planes of
/// their closest points. The lever is the measured point's: where the model should come to lie.
void add_surface(const Surface& object, const Surface& model, const ClosestPointTable& table,
                 const Pose& pose, std::size_t step, kernels::PairGate gate, Sums& sums) noexcept {
  const kernels::Motion inward = kernels::motion_of(pose.inverse());
  const kernels::OrientedPlanes surface = planes_of(model);
  const kernels::OrientedPlanes points = planes_of(object);
  NormalEquations of_points(sums.centre);
  kernels::PointBlock block;
  for (std::size_t first = 0; first < object.size;) {
    first = take_block(points, object.size, first, step, block);
    kernels::move_block(inward, block);
    table.closest_of_each(block.x, block.y, block.z, block.size, std::sqrt(gate.max_square_m2),
                          block.partner);
    std::fill(block.partner + block.size, block.partner + kernels::in_lanes(block.size), -1);
    const PlanePairs pairs = add_plane_pairs(block, surface, gate, of_points);
    sums.square_m2 += pairs.square_m2;
    sums.partners += pairs.count;
  }
  sums.equations.add_opposite(of_points, pose.linear());
}

/// Adds the outline; all of it together counts `share` of the surface.
void add_outline(const Surface& model, const ModelRender& render, const DepthView& view,
                 const EdgeMap& edges, const Pose& pose, double reach_m, double share,
                 Sums& sums) noexcept {
  if (render.contour().empty()) return;
  const double each =
      share * static_cast<double>(sums.partners) / static_cast<double>(render.contour().size());
  for (const ContourPoint& point : render.contour()) {
    const Vec3d x = pose * model.point(static_cast<std::size_t>(point.point)).cast<double>();
    const double u = view.intrinsics.fx * x.x() / x.z() + view.intrinsics.cx;
    const double v = view.intrinsics.fy * x.y() / x.z() + view.intrinsics.cy;
    if (!(u > -1.0 && v > -1.0 && u < 65536.0 && v < 65536.0)) continue;
    const double per_px = x.z() / view.intrinsics.fx;
    const double reach_px = std::max(1.5, reach_m / per_px);
    const EdgeMap::Nearest edge =
        edges.nearest(static_cast<int>(u + 0.5), static_cast<int>(v + 0.5), reach_px);
    if (!edge.found) continue;
    const double z_edge = static_cast<double>(view.z_m(edge.u, edge.v));
    // The edge must be one of this surface, not of something before or behind it.
    if (std::fabs(z_edge - x.z()) > 0.05 * x.z()) continue;
    const double nu = static_cast<double>(point.out_u);
    const double nv = static_cast<double>(point.out_v);
    const double off_px = nu * (u - edge.u) + nv * (v - edge.v);
    const Vec3d direction(nu, nv, -(nu * x.x() + nv * x.y()) / x.z());
    const double residual =
        off_px * (nu * nu + nv * nv * view.intrinsics.fx / view.intrinsics.fy) * per_px;
    sums.equations.add(direction, x, residual,
                       each * redescend(residual, std::max(per_px, 0.5 * reach_m)));
  }
}

}  // namespace

FieldTable contour_fit_fields() noexcept {
  using P = ContourFitParams;
  static constexpr std::array kFields = {
      number_field<&P::iterations>("iterations", "", 0, 100, "joint iterations"),
      number_field<&P::render_every>("render_every", "", 1, 100,
                                     "iterations between two predictions of the outline"),
      number_field<&P::max_points>("max_points", "", 32, 100000, "points of the object used"),
      number_field<&P::contour_weight>("contour_weight", "", 0.0, 10.0,
                                       "outline against surface; 0 = surface only"),
      number_field<&P::max_distance_ratio>("max_distance_ratio", "spacings", 0.5, 100.0,
                                           "partners on the surface"),
      number_field<&P::start_reach_ratio>("start_reach_ratio", "diameters", 0.001, 1.0,
                                          "outline partners at first"),
      number_field<&P::end_reach_ratio>("end_reach_ratio", "diameters", 0.001, 1.0,
                                        "outline partners at last"),
  };
  return kFields;
}

Result<RefinedPose> ContourFit::refine(const Surface& object, const Surface& model,
                                       const ClosestPointTable& table, const DepthView& view,
                                       const EdgeMap& edges, const Pose& camera_from_model,
                                       double diameter_m, ModelRender& render) noexcept {
  const std::size_t step = point_step(object.size, params_.max_points);
  kernels::PairGate gate;
  gate.cos_normal = kCosNormal;
  for (int axis = 0; axis < 3; ++axis)
    gate.centre[axis] = static_cast<float>(centroid(model)[axis]);
  const Vec3d centre(static_cast<double>(gate.centre[0]), static_cast<double>(gate.centre[1]),
                     static_cast<double>(gate.centre[2]));

  RefinedPose result;
  result.target_from_source = camera_from_model;
  Pose rendered = camera_from_model;
  for (int iteration = 0; iteration < params_.iterations; ++iteration) {
    const Pose& pose = result.target_from_source;
    const double progress =
        static_cast<double>(iteration) / static_cast<double>(std::max(1, params_.iterations - 1));
    const double outline_m =
        diameter_m * (params_.start_reach_ratio +
                      (params_.end_reach_ratio - params_.start_reach_ratio) * progress);
    const double reach_m = params_.max_distance_ratio * model.spacing_m;
    Sums sums{NormalEquations(pose * centre), centre};
    const double z_m = std::max(0.0, (pose * centre).z());
    const double scale_m = std::max(
        3.0 * static_cast<double>(view.noise.sigma_m(static_cast<float>(z_m))), 0.5 * reach_m);
    gate.max_square_m2 = static_cast<float>(reach_m * reach_m);
    gate.kernel_square_m2 = static_cast<float>(scale_m * scale_m);
    add_surface(object, model, table, pose, step, gate, sums);
    if (sums.partners < kFewestPartners) {
      return Error{Code::RefinementDiverged, Stage::Refine,
                   static_cast<std::int32_t>(sums.partners)};
    }
    if (params_.contour_weight > 0.0) {
      const bool due = iteration % params_.render_every == 0 &&
                       (iteration == 0 || displacement_m(pose, rendered, centre, 0.5 * diameter_m) >
                                              kSamePicture_px * z_m / view.intrinsics.fx);
      if (due) {
        render.render(model, pose, view);
        render.find_contour(model, pose, view);
        rendered = pose;
      }
      add_outline(model, render, view, edges, pose, outline_m, params_.contour_weight, sums);
    }
    const Vec6d update = sums.equations.solve(kFreezeRatio);
    result.information = sums.equations.information_at_origin();
    result.target_from_source = moved(pose, update, sums.equations.centre());
    result.rmse_m = std::sqrt(sums.square_m2 / static_cast<double>(sums.partners));
    result.partners = sums.partners;
    result.iterations = static_cast<std::uint32_t>(iteration) + 1;
    result.converged = update.head<3>().norm() < 1e-4 && update.tail<3>().norm() < 5e-4;
  }
  if (!result.target_from_source.matrix().allFinite()) {
    return Error{Code::RefinementDiverged, Stage::Refine, 0};
  }
  return result;
}

}  // namespace grapnel
