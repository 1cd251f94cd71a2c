#include "pipeline/coarse/triples.h"

#include <algorithm>
#include <array>
#include <limits>

#include "pipeline/coarse/kabsch.h"

namespace grapnel {
namespace {

std::size_t point_of(std::span<const Keypoint> keypoints, std::int32_t keypoint) noexcept {
  return static_cast<std::size_t>(keypoints[static_cast<std::size_t>(keypoint)].point);
}

bool edges_agree(const Vec3f& sa, const Vec3f& sb, const Vec3f& ta, const Vec3f& tb,
                 const TripleCheck& check) noexcept {
  const auto source = static_cast<double>((sa - sb).squaredNorm());
  const auto target = static_cast<double>((ta - tb).squaredNorm());
  if (source < check.min_edge_m * check.min_edge_m) return false;
  const double ratio = check.min_edge_ratio * check.min_edge_ratio;
  return std::min(source, target) >= ratio * std::max(source, target);
}

}  // namespace

bool draw_pose(const PairView& pair, const Correspondences& correspondences,
               const TripleCheck& check, Rng& rng, Pose& target_from_source) noexcept {
  const auto count = static_cast<std::uint32_t>(correspondences.size());
  std::array<std::size_t, 3> source{};
  std::array<std::size_t, 3> target{};
  std::array<Vec3f, 3> s, t;
  for (std::size_t k = 0; k < 3; ++k) {
    const Correspondence& chosen = correspondences[rng.below(count)];
    source[k] = point_of(pair.source_keypoints, chosen.source);
    target[k] = point_of(pair.target_keypoints, chosen.target);
    s[k] = pair.source->point(source[k]);
    t[k] = pair.target->point(target[k]);
    for (std::size_t j = 0; j < k; ++j) {
      if (!edges_agree(s[j], s[k], t[j], t[k], check)) return false;
    }
  }
  PointPairSums sums;
  for (std::size_t k = 0; k < 3; ++k) sums.add(s[k].cast<double>(), t[k].cast<double>());
  target_from_source = best_rigid_motion(sums);
  const Eigen::Matrix3f rotation = target_from_source.linear().cast<float>();
  for (std::size_t k = 0; k < 3; ++k) {
    if (!pair.source->has_normal(source[k]) || !pair.target->has_normal(target[k])) continue;
    const float cosine =
        (rotation * pair.source->normal(source[k])).dot(pair.target->normal(target[k]));
    if (static_cast<double>(cosine) < check.cos_normal) return false;
  }
  return true;
}

double extent_m(const Surface& surface, std::span<const Keypoint> keypoints) noexcept {
  if (keypoints.empty()) return 0.0;
  Vec3f low = Vec3f::Constant(std::numeric_limits<float>::max());
  Vec3f high = -low;
  for (const Keypoint& keypoint : keypoints) {
    const Vec3f p = surface.point(static_cast<std::size_t>(keypoint.point));
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  return static_cast<double>((high - low).norm());
}

}  // namespace grapnel
