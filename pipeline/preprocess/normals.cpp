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

/// Moments of a list of neighbours about the point, in double.
Symmetric3 covariance_of(const Surface& surface, std::size_t point_i,
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
  const auto needed = static_cast<std::size_t>(params_.min_neighbours);
  for (std::size_t i = 0; i < surface.size; ++i) {
    Symmetric3 spread;
    std::size_t count = 0;
    if (params_.k > 0) {
      const Neighbourhood around =
          search_.nearest(surface.point(i), static_cast<std::size_t>(params_.k));
      count = around.size();
      spread = covariance_of(surface, i, around);
    } else {
      const kernels::SphereMoments moments = search_.moments(i, static_cast<float>(radius));
      count = static_cast<std::size_t>(moments.count);
      spread = covariance(moments);
    }
    Vec3d normal = Vec3d::Zero();
    double variation = 0.0;
    const Vec3d values = eigenvalues_symmetric3(spread);
    if (count >= needed && values[1] > kLineRatio * values[2]) {
      normal = smallest_eigenvector(spread, values);
      variation = std::max(0.0, values[0]) / values.sum();
      const double toward = normal.dot(middle - surface.point(i).cast<double>());
      if (surface.has_viewpoint ? toward < 0.0 : toward > 0.0) normal = -normal;
    }
    surface.nx[i] = static_cast<float>(normal.x());
    surface.ny[i] = static_cast<float>(normal.y());
    surface.nz[i] = static_cast<float>(normal.z());
    curvature_memory_[i] = static_cast<float>(variation);
  }
  return {};
}

}  // namespace grapnel
