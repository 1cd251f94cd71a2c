#include "pipeline/refine/contour_fit.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "pipeline/refine/normal_equations.h"

namespace grapnel {
namespace {

constexpr std::uint32_t kFewestPartners = 12;
constexpr float kCosNormal = 0.6F;
constexpr double kFreezeRatio = 1e-4;

struct Sums {
  NormalEquations equations;
  double square_m2 = 0.0;
  std::uint32_t partners = 0;
};

double redescend(double residual, double scale) noexcept {
  const double root = scale * scale / (scale * scale + residual * residual);
  return root * root;
}

void add_surface(const Surface& object, const Surface& model, const ClosestPointTable& table,
                 const Pose& pose, std::size_t step, float reach_m, double scale_m,
                 Sums& sums) noexcept {
  const Eigen::Matrix3f rotation = pose.linear().cast<float>();
  const Vec3f shift = pose.translation().cast<float>();
  for (std::size_t i = 0; i < object.size; i += step) {
    const Vec3f q = object.point(i);
    const std::int32_t found = table.closest(rotation.transpose() * (q - shift), reach_m);
    if (found < 0) continue;
    const auto partner = static_cast<std::size_t>(found);
    const Vec3f normal = rotation * model.normal(partner);
    if (object.has_normal(i) && normal.dot(object.normal(i)) < kCosNormal) continue;
    const Vec3d x = (rotation * model.point(partner) + shift).cast<double>();
    const double residual = normal.cast<double>().dot(x - q.cast<double>());
    // The measured point is where the model should come to lie; the lever is that of the point.
    sums.equations.add(normal.cast<double>(), q.cast<double>(), residual,
                       redescend(residual, scale_m));
    sums.square_m2 += residual * residual;
    ++sums.partners;
  }
}

/// Weight of one outline point so that the whole outline counts `share` of the surface.
void add_outline(const Surface& model, const ModelRender& render, const DepthView& view,
                 const EdgeMap& edges, const Pose& pose, int reach_px, double share,
                 Sums& sums) noexcept {
  if (render.contour().empty() || !(share > 0.0)) return;
  const double each =
      share * static_cast<double>(sums.partners) / static_cast<double>(render.contour().size());
  for (const ContourPoint& point : render.contour()) {
    const int u = static_cast<int>(std::floor(point.u + 0.5F));
    const int v = static_cast<int>(std::floor(point.v + 0.5F));
    if (!view.box.contains(u, v)) continue;
    const EdgeMap::Nearest edge = edges.nearest(u, v);
    if (!edge.found || edge.square > reach_px * reach_px) continue;
    const Vec3d x = pose * model.point(static_cast<std::size_t>(point.point)).cast<double>();
    const double z_edge = static_cast<double>(view.z_m(edge.u, edge.v));
    // The edge must be one of this surface, not of something before or behind it.
    if (std::fabs(z_edge - x.z()) > 0.05 * x.z()) continue;
    const double nu = static_cast<double>(point.out_u);
    const double nv = static_cast<double>(point.out_v);
    const double off_px =
        nu * (static_cast<double>(point.u) - edge.u) + nv * (static_cast<double>(point.v) - edge.v);
    const double per_u = x.z() / view.intrinsics.fx;
    const double per_v = x.z() / view.intrinsics.fy;
    const Vec3d direction(nu, nv, -(nu * x.x() + nv * x.y()) / x.z());
    const double residual = off_px * (nu * nu * per_u + nv * nv * per_v);
    sums.equations.add(direction, x, residual, each * redescend(residual, 0.5 * reach_px * per_u));
  }
}

}  // namespace

FieldTable contour_fit_fields() noexcept {
  using P = ContourFitParams;
  static constexpr std::array kFields = {
      number_field<&P::iterations>("iterations", "", 0, 100, "joint iterations"),
      number_field<&P::max_points>("max_points", "", 32, 100000, "points of the object used"),
      number_field<&P::contour_weight>("contour_weight", "", 0.0, 10.0,
                                       "outline against surface; 0 = surface only"),
      number_field<&P::max_distance_ratio>("max_distance_ratio", "spacings", 0.5, 100.0,
                                           "partners on the surface"),
      number_field<&P::start_reach_px>("start_reach_px", "px", 1, 200, "outline partners at first"),
      number_field<&P::end_reach_px>("end_reach_px", "px", 1, 200, "outline partners at last"),
  };
  return kFields;
}

Result<RefinedPose> ContourFit::refine(const Surface& object, const Surface& model,
                                       const ClosestPointTable& table, const DepthView& view,
                                       const EdgeMap& edges, const Pose& camera_from_model,
                                       ModelRender& render) noexcept {
  const std::size_t step =
      std::max<std::size_t>(1, (object.size + params_.max_points - 1) / params_.max_points);
  Vec3d centre = Vec3d::Zero();
  for (std::size_t i = 0; i < model.size; ++i) centre += model.point(i).cast<double>();
  centre /= static_cast<double>(model.size);

  RefinedPose result;
  result.target_from_source = camera_from_model;
  for (int iteration = 0; iteration < params_.iterations; ++iteration) {
    const Pose& pose = result.target_from_source;
    const int last = std::max(1, params_.iterations - 1);
    const int reach_px =
        params_.start_reach_px + (params_.end_reach_px - params_.start_reach_px) * iteration / last;
    const double reach_m = params_.max_distance_ratio * model.spacing_m;
    Sums sums{NormalEquations(pose * centre)};
    const double z_m = std::max(0.0, (pose * centre).z());
    const double scale_m = std::max(
        3.0 * static_cast<double>(view.noise.sigma_m(static_cast<float>(z_m))), 0.5 * reach_m);
    add_surface(object, model, table, pose, step, static_cast<float>(reach_m), scale_m, sums);
    if (sums.partners < kFewestPartners) {
      return Error{Code::RefinementDiverged, Stage::Refine,
                   static_cast<std::int32_t>(sums.partners)};
    }
    if (params_.contour_weight > 0.0) {
      render.render(model, pose, view);
      render.find_contour(model, pose, view);
      add_outline(model, render, view, edges, pose, reach_px, params_.contour_weight, sums);
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
