#include "pipeline/preprocess/principal_curvature.h"

#include <algorithm>
#include <cmath>

#include "pipeline/kernels/tangent_spread.h"

namespace grapnel {

FieldTable curvature_fields() noexcept {
  static constexpr std::array<std::string_view, 2> kEngines = {"fast", "reference"};
  static constexpr std::array kFields = {
      choice_field<&CurvatureParams::engine>("engine", kEngines, "fast, or plain loops in double"),
      number_field<&CurvatureParams::radius_m>("radius_m", "m", 0.0, 10.0,
                                               "sphere of the normals; 0 = radius_ratio spacings"),
      number_field<&CurvatureParams::radius_ratio>(
          "radius_ratio", "spacings", 1.0, 50.0,
          "sphere of the normals in spacings of the surface"),
  };
  return kFields;
}

void PrincipalCurvature::reserve(Arena& arena, const Limits& limits) {
  const std::size_t points = std::max(limits.max_points, limits.max_model_points);
  sums_.reserve(arena, limits);
  const std::size_t padded = points + SphereSums::kPadding;
  pc1_ = arena.take<float>(padded);
  pc2_ = arena.take<float>(padded);
  for (std::span<float>& plane : direction_) plane = arena.take<float>(padded);
}

/// Projecting the normals with M = I - n nᵀ turns their covariance C into M C M, whose third
/// eigenvalue is 0 along n: what is left is 2×2 in any basis of the tangent plane.
void PrincipalCurvature::store(std::size_t point_i, const Vec3d& normal,
                               const Symmetric3& covariance) noexcept {
  const Vec3d v = normal.unitOrthogonal();
  const Vec3d u = v.cross(normal);
  const auto times = [&](const Vec3d& p) {
    const Symmetric3& c = covariance;
    return Vec3d(c.xx * p.x() + c.xy * p.y() + c.xz * p.z(),
                 c.xy * p.x() + c.yy * p.y() + c.yz * p.z(),
                 c.xz * p.x() + c.yz * p.y() + c.zz * p.z());
  };
  const Vec3d cu = times(u);
  const double uu = u.dot(cu);
  const double uv = v.dot(cu);
  const double vv = v.dot(times(v));
  const double middle = 0.5 * (uu + vv);
  const double half = 0.5 * (uu - vv);
  const double spread = std::sqrt(half * half + uv * uv);
  // Eigenvector of the larger eigenvalue, from the row that does not cancel.
  Vec3d along =
      half >= 0.0 ? Vec3d((half + spread) * u + uv * v) : Vec3d(uv * u + (spread - half) * v);
  const double length = along.norm();
  along = length > 0.0 ? Vec3d(along / length) : u;
  pc1_[point_i] = static_cast<float>(middle + spread);
  pc2_[point_i] = static_cast<float>(std::max(0.0, middle - spread));
  for (std::size_t axis = 0; axis < 3; ++axis) {
    direction_[axis][point_i] = static_cast<float>(along[static_cast<Eigen::Index>(axis)]);
  }
}

void PrincipalCurvature::estimate_fast(const Surface& surface) noexcept {
  sums_.normals(true);
  kernels::TangentSums sums;
  sums.count = sums_.count().data();
  for (std::size_t axis = 0; axis < 3; ++axis) sums.first[axis] = sums_.first(axis).data();
  sums.products = sums_.products();
  sums.normal[0] = surface.nx.data();
  sums.normal[1] = surface.ny.data();
  sums.normal[2] = surface.nz.data();
  kernels::tangent_spread(sums, surface.size, pc1_.data(), pc2_.data(),
                          {direction_[0].data(), direction_[1].data(), direction_[2].data()});
}

void PrincipalCurvature::estimate_plainly(const Surface& surface) noexcept {
  for (const std::span<float>& plane : {pc1_, pc2_, direction_[0], direction_[1], direction_[2]}) {
    std::fill_n(plane.begin(), surface.size, 0.0F);
  }
  for (std::size_t i = 0; i < surface.size; ++i) {
    if (!surface.has_normal(i)) continue;
    const Neighbourhood around = sums_.search().within(i, static_cast<float>(radius_m_));
    Vec3d mean = Vec3d::Zero();
    double count = 0.0;
    for (const std::int32_t index : around.index) {
      const auto other = static_cast<std::size_t>(index);
      if (!surface.has_normal(other)) continue;
      mean += surface.normal(other).cast<double>();
      count += 1.0;
    }
    mean /= count;
    Symmetric3 sum;
    for (const std::int32_t index : around.index) {
      const auto other = static_cast<std::size_t>(index);
      if (!surface.has_normal(other)) continue;
      const Vec3d d = surface.normal(other).cast<double>() - mean;
      sum.add(d.x(), d.y(), d.z());
    }
    store(i, surface.normal(i).cast<double>(), sum.over(count));
  }
}

Status PrincipalCurvature::estimate(const Surface& surface) noexcept {
  size_ = 0;
  radius_m_ = params_.radius_m > 0.0 ? params_.radius_m : params_.radius_ratio * surface.spacing_m;
  if (!(radius_m_ > 0.0)) return Error{Code::BadParameter, Stage::Normals, 0};
  if (const Status built = sums_.build(surface, radius_m_); !built.ok()) {
    return Error{built.error().code, Stage::Normals, built.error().detail};
  }
  size_ = surface.size;
  if (params_.engine == Engine::Fast) {
    estimate_fast(surface);
  } else {
    estimate_plainly(surface);
  }
  return {};
}

}  // namespace grapnel
