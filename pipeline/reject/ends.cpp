#include "pipeline/reject/ends.h"

#include <algorithm>

namespace grapnel {

void PairEnds::reserve(Arena& arena, std::size_t max_pairs) {
  for (std::span<float>& plane : planes_) plane = arena.take<float>(max_pairs + 8);
}

bool PairEnds::gather(const PairView& pair, const Correspondences& pairs) noexcept {
  size_ = 0;
  if (pairs.size() + 8 > planes_[0].size()) return false;
  if (pairs.empty()) return true;
  const Vec3f source_origin = pair.source->point(source_point(pair, pairs[0]));
  const Vec3f target_origin = pair.target->point(target_point(pair, pairs[0]));
  for (const Correspondence& c : pairs) {
    const Vec3f s = pair.source->point(source_point(pair, c)) - source_origin;
    const Vec3f t = pair.target->point(target_point(pair, c)) - target_origin;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      planes_[axis][size_] = s[static_cast<Eigen::Index>(axis)];
      planes_[3 + axis][size_] = t[static_cast<Eigen::Index>(axis)];
    }
    ++size_;
  }
  for (const std::span<float> plane : planes_) std::ranges::fill(plane.subspan(size_, 8), 0.0F);
  return true;
}

kernels::PairPlanes PairEnds::planes() const noexcept {
  return {planes_[0].data(), planes_[1].data(), planes_[2].data(),
          planes_[3].data(), planes_[4].data(), planes_[5].data()};
}

}  // namespace grapnel
