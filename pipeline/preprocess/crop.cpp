#include "pipeline/preprocess/crop.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "pipeline/preprocess/compact.h"

namespace grapnel {

FieldTable crop_fields() noexcept {
  using P = CropParams;
  static constexpr std::array kFields = {
      number_field<&P::min_x_m>("min_x_m", "m", -1000.0, 1000.0, "least x of the box"),
      number_field<&P::min_y_m>("min_y_m", "m", -1000.0, 1000.0, "least y"),
      number_field<&P::min_z_m>("min_z_m", "m", -1000.0, 1000.0, "least z"),
      number_field<&P::max_x_m>("max_x_m", "m", -1000.0, 1000.0, "largest x"),
      number_field<&P::max_y_m>("max_y_m", "m", -1000.0, 1000.0, "largest y"),
      number_field<&P::max_z_m>("max_z_m", "m", -1000.0, 1000.0, "largest z"),
      bool_field<&P::inside>("inside", "keep what lies in the box; else what lies outside of it"),
  };
  return kFields;
}

void Crop::reserve(Arena& arena, const Limits& limits) {
  keep_ = arena.take<std::uint8_t>(
      std::max({limits.max_input_points, limits.max_points, limits.max_model_points}));
}

Result<std::size_t> Crop::apply(Surface& surface) noexcept {
  if (const Status status = check_points(surface, keep_.size(), Stage::Background); !status.ok()) {
    return status.error();
  }
  // In float, as the coordinates are: a point on a face is inside.
  const auto low_x = static_cast<float>(params_.min_x_m);
  const auto low_y = static_cast<float>(params_.min_y_m);
  const auto low_z = static_cast<float>(params_.min_z_m);
  const auto high_x = static_cast<float>(params_.max_x_m);
  const auto high_y = static_cast<float>(params_.max_y_m);
  const auto high_z = static_cast<float>(params_.max_z_m);
  for (std::size_t i = 0; i < surface.size; ++i) {
    const Vec3f p = surface.point(i);
    const bool in = p.x() >= low_x && p.y() >= low_y && p.z() >= low_z && p.x() <= high_x &&
                    p.y() <= high_y && p.z() <= high_z;
    keep_[i] = in == params_.inside ? 1 : 0;
  }
  return keep_points(surface, keep_);
}

}  // namespace grapnel
