#include "pipeline/preprocess/normals.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "pipeline/neighbours/symmetric3.h"

namespace grapnel {

FieldTable pca_normals_fields() noexcept {
  static constexpr std::array kFields = {
      number_field<&PcaNormalsParams::radius_m>("radius_m", "m", 0.0, 10.0,
                                                "neighbourhood; 0 = radius_ratio spacings"),
      number_field<&PcaNormalsParams::radius_ratio>("radius_ratio", "", 1.0, 20.0,
                                                    "neighbourhood in spacings of the surface"),
      number_field<&PcaNormalsParams::k>("k", "", 0, 1000,
                                         "nearest points instead of a radius; 0 = radius"),
      number_field<&PcaNormalsParams::min_neighbours>("min_neighbours", "", 3, 1000,
                                                      "fewer, the point included, give no normal"),
  };
  return kFields;
}

namespace {

/// Second eigenvalue to largest below which a neighbourhood is a line and has no plane.
constexpr double kLineRatio = 1e-4;

Vec3d centroid(const Surface& surface) noexcept {
  Vec3d sum = Vec3d::Zero();
  for (std::size_t i = 0; i < surface.size; ++i) sum += surface.point(i).cast<double>();
  return sum / static_cast<double>(surface.size);
}

/// Covariance of the neighbours, summed about the point itself against cancellation.
Symmetric3 covariance(const Surface& surface, std::size_t point_i,
                      const Neighbourhood& around) noexcept {
  const Vec3d origin = surface.point(point_i).cast<double>();
  Symmetric3 sum;
  Vec3d mean = Vec3d::Zero();
  for (const std::int32_t index : around.index) {
    const Vec3d d = surface.point(static_cast<std::size_t>(index)).cast<double>() - origin;
    sum.add(d.x(), d.y(), d.z());
    mean += d;
  }
  const double inverse = 1.0 / static_cast<double>(around.size());
  mean *= inverse;
  return {sum.xx * inverse - mean.x() * mean.x(), sum.xy * inverse - mean.x() * mean.y(),
          sum.xz * inverse - mean.x() * mean.z(), sum.yy * inverse - mean.y() * mean.y(),
          sum.yz * inverse - mean.y() * mean.z(), sum.zz * inverse - mean.z() * mean.z()};
}

}  // namespace

void PcaNormals::reserve(Arena& arena, const Limits& limits) {
  search_.reserve(arena, limits);
  curvature_memory_ = arena.take<float>(std::max(limits.max_points, limits.max_model_points));
}

Status PcaNormals::estimate(Surface& surface) noexcept {
  const double radius =
      params_.radius_m > 0.0 ? params_.radius_m : params_.radius_ratio * surface.spacing_m;
  if (params_.k == 0 && !(radius > 0.0)) return Error{Code::BadParameter, Stage::Normals, 0};
  const double typical = radius > 0.0 ? radius : 1e-3;
  if (const Status built = search_.build(surface, typical); !built.ok()) {
    return Error{built.error().code, Stage::Normals, built.error().detail};
  }
  curvature_ = curvature_memory_.first(surface.size);
  const Vec3d middle =
      surface.has_viewpoint ? Vec3d(surface.viewpoint.cast<double>()) : centroid(surface);
  for (std::size_t i = 0; i < surface.size; ++i) {
    const Neighbourhood around =
        params_.k > 0 ? search_.nearest(surface.point(i), static_cast<std::size_t>(params_.k))
                      : search_.within(i, static_cast<float>(radius));
    Vec3d normal = Vec3d::Zero();
    double variation = 0.0;
    if (around.size() >= static_cast<std::size_t>(params_.min_neighbours)) {
      const Eigen3 eigen = eigen_symmetric3(covariance(surface, i, around));
      if (eigen.values[1] > kLineRatio * eigen.values[2]) {
        normal = eigen.vectors.col(0);
        const double sum = eigen.values.sum();
        variation = sum > 0.0 ? std::max(0.0, eigen.values[0]) / sum : 0.0;
        const Vec3d to_middle = middle - surface.point(i).cast<double>();
        const double toward = normal.dot(to_middle);
        if (surface.has_viewpoint ? toward < 0.0 : toward > 0.0) normal = -normal;
      }
    }
    surface.nx[i] = static_cast<float>(normal.x());
    surface.ny[i] = static_cast<float>(normal.y());
    surface.nz[i] = static_cast<float>(normal.z());
    curvature_memory_[i] = static_cast<float>(variation);
  }
  return {};
}

}  // namespace grapnel
