#include "pipeline/preprocess/radius_outliers.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "pipeline/preprocess/compact.h"

namespace grapnel {

FieldTable radius_outlier_fields() noexcept {
  using P = RadiusOutlierParams;
  static constexpr std::array kFields = {
      number_field<&P::radius_m>("radius_m", "m", 0.0, 10.0, "0 = radius_ratio spacings"),
      number_field<&P::radius_ratio>("radius_ratio", "", 1.0, 20.0,
                                     "radius in spacings of the surface"),
      number_field<&P::min_neighbours>("min_neighbours", "", 1, 1000,
                                       "other points that must lie within the radius"),
  };
  return kFields;
}

void RadiusOutliers::reserve(Arena& arena, const Limits& limits) {
  const std::size_t points =
      std::max({limits.max_input_points, limits.max_points, limits.max_model_points});
  search_.reserve(
      arena, points,
      static_cast<std::size_t>(limits.max_width) * static_cast<std::size_t>(limits.max_height));
  keep_ = arena.take<std::uint8_t>(points);
}

Result<std::size_t> RadiusOutliers::apply(Surface& surface) noexcept {
  if (const Status status = check_points(surface, keep_.size(), Stage::Outliers); !status.ok()) {
    return status.error();
  }
  const double radius_m =
      params_.radius_m > 0.0 ? params_.radius_m : params_.radius_ratio * surface.spacing_m;
  if (!(radius_m > 0.0)) return Error{Code::BadParameter, Stage::Outliers, 0};
  if (const Status status = search_.build(surface, radius_m); !status.ok()) {
    return Error{status.error().code, Stage::Outliers, status.error().detail};
  }
  const auto needed = static_cast<std::size_t>(params_.min_neighbours) + 1;
  for (std::size_t i = 0; i < surface.size; ++i) {
    keep_[i] = search_.within(i, static_cast<float>(radius_m)).size() >= needed ? 1 : 0;
  }
  return keep_points(surface, keep_);
}

}  // namespace grapnel
