#include "pipeline/preprocess/z_median.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "pipeline/preprocess/compact.h"

namespace grapnel {
namespace {

constexpr int kMaxWindow = 31;

/// Upper median of the depths in the window around (u, v), which holds at least its centre.
float median_around(const Surface& surface, int u, int v, int half) noexcept {
  const Surface::Grid& grid = surface.grid;
  std::array<float, kMaxWindow * kMaxWindow> values;
  std::size_t count = 0;
  for (int row = std::max(0, v - half); row <= std::min(grid.height - 1, v + half); ++row) {
    for (int column = std::max(0, u - half); column <= std::min(grid.width - 1, u + half);
         ++column) {
      const std::int32_t point =
          grid.point_of[static_cast<std::size_t>(row) * static_cast<std::size_t>(grid.width) +
                        static_cast<std::size_t>(column)];
      if (point >= 0) values[count++] = surface.z[static_cast<std::size_t>(point)];
    }
  }
  if (count == 0) return 0.0F;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(count / 2);
  std::nth_element(values.begin(), middle, values.begin() + static_cast<std::ptrdiff_t>(count));
  return *middle;
}

}  // namespace

FieldTable z_median_fields() noexcept {
  using P = ZMedianParams;
  static constexpr std::array kFields = {
      number_field<&P::window>("window", "px", 1, kMaxWindow, "side of the window; made odd"),
      number_field<&P::max_movement_m>("max_movement_m", "m", 0.0, 1e6,
                                       "a depth changes by at most this"),
      bool_field<&P::keep_rays>("keep_rays", "x and y follow the depth; PCL's filter: false"),
  };
  return kFields;
}

void ZMedian::reserve(Arena& arena, const Limits& limits) {
  z_ = arena.take<float>(
      std::max({limits.max_input_points, limits.max_points, limits.max_model_points}));
}

Result<std::size_t> ZMedian::apply(Surface& surface) noexcept {
  if (const Status status = check_points(surface, z_.size(), Stage::Median); !status.ok()) {
    return status.error();
  }
  if (!surface.organised()) return Error{Code::BadParameter, Stage::Median, 0};
  const auto limit = static_cast<float>(params_.max_movement_m);
  for (std::size_t i = 0; i < surface.size; ++i) {
    const std::int32_t pixel = surface.grid.pixel_of[i];
    const float z = median_around(surface, pixel % surface.grid.width, pixel / surface.grid.width,
                                  params_.window / 2);
    z_[i] = std::clamp(z, surface.z[i] - limit, surface.z[i] + limit);
  }
  for (std::size_t i = 0; i < surface.size; ++i) {
    if (params_.keep_rays && surface.z[i] != 0.0F) {
      const float scale = z_[i] / surface.z[i];
      surface.x[i] *= scale;
      surface.y[i] *= scale;
    }
    surface.z[i] = z_[i];
  }
  return std::size_t{0};
}

}  // namespace grapnel
