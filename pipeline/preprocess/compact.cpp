#include "pipeline/preprocess/compact.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace grapnel {

std::size_t keep_points(Surface& surface, std::span<const std::uint8_t> keep) noexcept {
  GRAPNEL_ASSERT(keep.size() >= surface.size);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < surface.size; ++i) {
    const bool stays = keep[i] != 0;
    if (surface.organised()) {
      const auto pixel = static_cast<std::size_t>(surface.grid.pixel_of[i]);
      surface.grid.point_of[pixel] = stays ? static_cast<std::int32_t>(kept) : -1;
      if (stays) surface.grid.pixel_of[kept] = surface.grid.pixel_of[i];
    }
    if (!stays) continue;
    for (std::span<float>* plane : {&surface.x, &surface.y, &surface.z, &surface.nx, &surface.ny,
                                    &surface.nz, &surface.intensity}) {
      (*plane)[kept] = (*plane)[i];
    }
    ++kept;
  }
  const std::size_t removed = surface.size - kept;
  surface.size = kept;
  return removed;
}

Status check_points(const Surface& surface, std::size_t capacity, Stage stage) noexcept {
  if (surface.size == 0) return Error{Code::TooFewPoints, stage, 0};
  if (surface.size > capacity) {
    return Error{Code::CapacityExceeded, stage, static_cast<std::int32_t>(surface.size)};
  }
  const auto finite = [](float value) {
    return std::fabs(value) <= std::numeric_limits<float>::max();
  };
  for (const std::span<float>& plane : {surface.x, surface.y, surface.z}) {
    const std::span<const float> values = plane.first(surface.size);
    // Without a way out the loop runs on vectors.
    unsigned bad = 0;
    for (const float value : values) bad |= finite(value) ? 0U : 1U;
    if (bad == 0) continue;
    const auto first = std::find_if_not(values.begin(), values.end(), finite);
    return Error{Code::BadParameter, stage, static_cast<std::int32_t>(first - values.begin())};
  }
  return {};
}

void drop_grid(Surface& surface) noexcept {
  surface.grid.width = 0;
  surface.grid.height = 0;
}

}  // namespace grapnel
