#include "pipeline/preprocess/uniform_sample.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "pipeline/preprocess/compact.h"

namespace grapnel {

FieldTable uniform_sample_fields() noexcept {
  using P = UniformSampleParams;
  static constexpr std::array kFields = {
      number_field<&P::cell_m>("cell_m", "m", 0.0, 10.0, "edge of a cell; 0 = cell_ratio spacings"),
      number_field<&P::cell_ratio>("cell_ratio", "", 0.1, 1000.0,
                                   "edge of a cell in spacings of the surface"),
  };
  return kFields;
}

void UniformSample::reserve(Arena& arena, const Limits& limits) {
  const std::size_t points =
      std::max({limits.max_input_points, limits.max_points, limits.max_model_points});
  cells_.reserve(arena, points);
  best_ = arena.take<std::uint32_t>(points);
  keep_ = arena.take<std::uint8_t>(points);
}

Result<std::size_t> UniformSample::apply(Surface& surface) noexcept {
  if (const Status status = check_points(surface, keep_.size(), Stage::Decimate); !status.ok()) {
    return status.error();
  }
  const double cell_m =
      params_.cell_m > 0.0 ? params_.cell_m : params_.cell_ratio * surface.spacing_m;
  if (!(cell_m > 0.0) || !cells_.number(surface, cell_m)) {
    return Error{Code::BadParameter, Stage::Decimate, 0};
  }
  const auto per_m = static_cast<float>(1.0 / cell_m);
  const auto off_centre = [&](std::size_t point) {
    const Vec3f place = surface.point(point) * per_m;
    const Vec3f centre = place.array().floor() + 0.5F;
    return (place - centre).squaredNorm();
  };
  constexpr std::uint32_t kNone = ~std::uint32_t{0};
  const std::span<std::uint32_t> best = best_.first(cells_.cells());
  std::fill(best.begin(), best.end(), kNone);
  for (std::uint32_t i = 0; i < surface.size; ++i) {
    std::uint32_t& chosen = best[cells_.cell_of()[i]];
    if (chosen == kNone || off_centre(i) < off_centre(chosen)) chosen = i;
  }
  std::fill_n(keep_.begin(), surface.size, std::uint8_t{0});
  for (const std::uint32_t chosen : best) keep_[chosen] = 1;
  return keep_points(surface, keep_);
}

}  // namespace grapnel
