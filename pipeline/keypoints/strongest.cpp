#include "pipeline/keypoints/strongest.h"

#include <algorithm>

namespace grapnel {

void keep_strongest(std::span<Keypoint> candidates, KeypointSet& keypoints) noexcept {
  keypoints.clear();
  auto end = candidates.end();
  if (candidates.size() > keypoints.capacity()) {
    end = candidates.begin() + static_cast<std::ptrdiff_t>(keypoints.capacity());
    std::nth_element(candidates.begin(), end, candidates.end(),
                     [](const Keypoint& a, const Keypoint& b) {
                       return a.score != b.score ? a.score > b.score : a.point < b.point;
                     });
    keypoints.mark_overflowed();
  }
  std::sort(candidates.begin(), end,
            [](const Keypoint& a, const Keypoint& b) { return a.point < b.point; });
  for (auto it = candidates.begin(); it != end; ++it) keypoints.push_back(*it);
}

}  // namespace grapnel
