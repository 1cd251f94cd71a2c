#include "pipeline/preprocess/flying_points.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/math.h"
#include "pipeline/preprocess/compact.h"

namespace grapnel {

FieldTable flying_point_fields() noexcept {
  using P = FlyingPointParams;
  static constexpr std::array kFields = {
      number_field<&P::min_support>("min_support", "", 0, 8,
                                    "of eight neighbours, how many lie on the same surface"),
      number_field<&P::sigma_1m_m>("sigma_1m_m", "m", 0.0, 0.1,
                                   "axial noise at 1 m, 1 sigma; grows with z²"),
      number_field<&P::sigmas>("sigmas", "", 0.0, 100.0, "of the noise that are no edge"),
      number_field<&P::max_slope_rad>("max_slope_rad", "rad", 0.0, 1.57,
                                      "incidence beyond which a step is an edge"),
      number_field<&P::max_grazing_rad>("max_grazing_rad", "rad", 0.0, 1.571,
                                        "points with a normal seen flatter than this go too"),
  };
  return kFields;
}

void FlyingPoints::reserve(Arena& arena, const Limits& limits) {
  keep_ = arena.take<std::uint8_t>(
      std::max({limits.max_input_points, limits.max_points, limits.max_model_points}));
}

int FlyingPoints::support(const Surface& surface, std::size_t point_i,
                          float slope_per_m) const noexcept {
  const Surface::Grid& grid = surface.grid;
  const std::int32_t pixel = grid.pixel_of[point_i];
  const int u = pixel % grid.width;
  const int v = pixel / grid.width;
  const float z = surface.z[point_i];
  const auto noise = static_cast<float>(params_.sigmas * params_.sigma_1m_m);
  int near = 0;
  for (int dv = -1; dv <= 1; ++dv) {
    for (int du = -1; du <= 1; ++du) {
      if (du == 0 && dv == 0) continue;
      if (u + du < 0 || v + dv < 0 || u + du >= grid.width || v + dv >= grid.height) continue;
      const std::int32_t other =
          grid.point_of[static_cast<std::size_t>(pixel + dv * grid.width + du)];
      if (other < 0) continue;
      const float other_z = surface.z[static_cast<std::size_t>(other)];
      const float nearer = std::min(z, other_z);
      const float limit = nearer * (slope_per_m + noise * nearer);
      near += std::fabs(z - other_z) <= limit ? 1 : 0;
    }
  }
  return near;
}

Result<std::size_t> FlyingPoints::apply(Surface& surface) noexcept {
  if (const Status status = check_points(surface, keep_.size(), Stage::Outliers); !status.ok()) {
    return status.error();
  }
  if (!surface.organised() || !(surface.grid.intrinsics.fx > 0.0)) {
    return Error{Code::BadParameter, Stage::Outliers, 0};
  }
  const double tangent = math::sin(params_.max_slope_rad) / math::cos(params_.max_slope_rad);
  const auto slope_per_m = static_cast<float>(tangent / surface.grid.intrinsics.fx);
  const auto flattest = static_cast<float>(math::cos(params_.max_grazing_rad));
  for (std::size_t i = 0; i < surface.size; ++i) {
    const Vec3f ray = surface.point(i) - surface.viewpoint;
    const bool grazed = surface.has_normal(i) && surface.has_viewpoint &&
                        std::fabs(surface.normal(i).dot(ray)) < flattest * ray.norm();
    keep_[i] = !grazed && support(surface, i, slope_per_m) >= params_.min_support ? 1 : 0;
  }
  return keep_points(surface, keep_);
}

}  // namespace grapnel
