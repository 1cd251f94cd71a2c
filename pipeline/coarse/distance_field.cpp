#include "pipeline/coarse/distance_field.h"

#include <algorithm>
#include <limits>

namespace grapnel {

void DistanceField::reserve(Arena& arena) {
  values_ = arena.take<std::uint8_t>(static_cast<std::size_t>(kSide) * kSide * kSide);
}

void DistanceField::build(const Surface& surface, const ClosestPointTable& table, double margin_m,
                          double reach_m) noexcept {
  Vec3f low = Vec3f::Constant(std::numeric_limits<float>::max());
  Vec3f high = -low;
  for (std::size_t i = 0; i < surface.size; ++i) {
    low = low.cwiseMin(surface.point(i));
    high = high.cwiseMax(surface.point(i));
  }
  const auto margin = static_cast<float>(margin_m);
  const auto reach = static_cast<float>(reach_m);
  const float side_m = std::max((high - low).maxCoeff(), 1e-9F) + 2.0F * margin;
  // Cubic voxels around the middle, so that one factor serves the three axes.
  origin_ = 0.5F * (low + high) - Vec3f::Constant(0.5F * side_m);
  per_metre_ = static_cast<float>(kSide) / side_m;
  const float last = static_cast<float>(kLevels - 1);
  for (std::size_t level = 0; level < kLevels; ++level) {
    const float ratio = static_cast<float>(level) / last;
    worth_[level] = 1.0F - ratio * ratio;
  }
  std::size_t k = 0;
  for (int z = 0; z < kSide; ++z) {
    for (int y = 0; y < kSide; ++y) {
      for (int x = 0; x < kSide; ++x, ++k) {
        const Vec3f centre =
            origin_ + (Vec3f(static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)) +
                       Vec3f::Constant(0.5F)) /
                          per_metre_;
        const std::int32_t found = table.closest(centre, reach);
        const float distance =
            found < 0 ? reach : (surface.point(static_cast<std::size_t>(found)) - centre).norm();
        values_[k] = static_cast<std::uint8_t>(std::min(last, last * distance / reach + 0.5F));
      }
    }
  }
}

}  // namespace grapnel
