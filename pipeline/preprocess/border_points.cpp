#include "pipeline/preprocess/border_points.h"

#include <algorithm>
#include <array>

#include "pipeline/neighbours/widest_gap.h"
#include "pipeline/preprocess/compact.h"

namespace grapnel {

FieldTable border_points_fields() noexcept {
  using P = BorderPointsParams;
  static constexpr std::array<std::string_view, 2> kKeep = {"inner", "border"};
  static constexpr std::array kFields = {
      choice_field<&P::keep>("keep", kKeep, "which points stay"),
      number_field<&P::radius_m>("radius_m", "m", 0.0, 10.0, "0 = radius_ratio spacings"),
      number_field<&P::radius_ratio>("radius_ratio", "", 1.0, 20.0,
                                     "radius in spacings of the surface"),
      number_field<&P::angle_rad>("angle_rad", "rad", 0.1, 6.2,
                                  "gap between a point's neighbours at a border"),
      number_field<&P::min_neighbours>("min_neighbours", "", 3, 1000,
                                       "fewer, the point included, make no border"),
  };
  return kFields;
}

void BorderPoints::reserve(Arena& arena, const Limits& limits) {
  const std::size_t points =
      std::max({limits.max_input_points, limits.max_points, limits.max_model_points});
  search_.reserve(
      arena, points,
      static_cast<std::size_t>(limits.max_width) * static_cast<std::size_t>(limits.max_height));
  flags_ = arena.take<std::uint8_t>(points);
  angles_ = arena.take<float>(points);
}

Result<std::span<const std::uint8_t>> BorderPoints::find(const Surface& surface) noexcept {
  if (const Status status = check_points(surface, flags_.size(), Stage::Outliers); !status.ok()) {
    return status.error();
  }
  const double radius_m =
      params_.radius_m > 0.0 ? params_.radius_m : params_.radius_ratio * surface.spacing_m;
  if (!(radius_m > 0.0)) return Error{Code::BadParameter, Stage::Outliers, 0};
  if (const Status status = search_.build(surface, radius_m); !status.ok()) {
    return Error{status.error().code, Stage::Outliers, status.error().detail};
  }
  for (std::size_t i = 0; i < surface.size; ++i) {
    flags_[i] = 0;
    if (!surface.has_normal(i)) continue;
    const Neighbourhood around = search_.within(i, static_cast<float>(radius_m));
    if (around.size() < static_cast<std::size_t>(params_.min_neighbours)) continue;
    if (widest_gap_rad(surface, i, around, angles_) > params_.angle_rad) flags_[i] = 1;
  }
  return std::span<const std::uint8_t>(flags_.first(surface.size));
}

Result<std::size_t> BorderPoints::apply(Surface& surface) noexcept {
  const Result<std::span<const std::uint8_t>> found = find(surface);
  if (!found.ok()) return found.error();
  if (params_.keep == BorderPointsParams::Keep::Inner) {
    for (std::uint8_t& flag : flags_.first(surface.size)) flag = flag == 0 ? 1 : 0;
  }
  return keep_points(surface, flags_);
}

}  // namespace grapnel
