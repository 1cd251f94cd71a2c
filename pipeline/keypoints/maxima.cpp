#include "pipeline/keypoints/maxima.h"

#include <algorithm>

namespace grapnel {

void LocalMaxima::reserve(Arena& arena, const Limits& limits) {
  const std::size_t points = std::max(limits.max_points, limits.max_model_points);
  ordered_ = arena.take<float>(points + kernels::kSlack);
  candidates_ = arena.take<Keypoint>(points);
}

std::span<Keypoint> LocalMaxima::find(NeighbourSearch& search, std::span<const float> scores,
                                      float threshold, float radius_m,
                                      std::size_t min_neighbours) noexcept {
  for (std::size_t position = 0; position < scores.size(); ++position) {
    ordered_[position] = scores[search.point_at(position)];
  }
  std::size_t count = 0;
  for (std::size_t position = 0; position < scores.size(); ++position) {
    const float own = ordered_[position];
    if (!(own >= threshold)) continue;
    if (search.exceeded(position, radius_m, ordered_.data())) continue;
    const std::size_t i = search.point_at(position);
    if (min_neighbours > 1 && search.within(i, radius_m).size() < min_neighbours) continue;
    candidates_[count++] = {static_cast<std::int32_t>(i), own, radius_m};
  }
  const std::span<Keypoint> found = candidates_.first(count);
  std::sort(found.begin(), found.end(),
            [](const Keypoint& a, const Keypoint& b) { return a.point < b.point; });
  return found;
}

}  // namespace grapnel
