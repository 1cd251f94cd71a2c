#include "pipeline/coarse/triples.h"

#include <algorithm>
#include <limits>

#include "pipeline/coarse/kabsch.h"

namespace grapnel {
namespace {

std::size_t point_of(std::span<const Keypoint> keypoints, std::int32_t keypoint) noexcept {
  return static_cast<std::size_t>(keypoints[static_cast<std::size_t>(keypoint)].point);
}

PlacedPair placed(const PairView& pair, const Correspondence& chosen) noexcept {
  PlacedPair there;
  there.source_point = point_of(pair.source_keypoints, chosen.source);
  there.target_point = point_of(pair.target_keypoints, chosen.target);
  there.source = pair.source->point(there.source_point);
  there.target = pair.target->point(there.target_point);
  return there;
}

bool edges_agree(const PlacedPair& a, const PlacedPair& b, const TripleCheck& check) noexcept {
  const auto source = static_cast<double>((a.source - b.source).squaredNorm());
  const auto target = static_cast<double>((a.target - b.target).squaredNorm());
  if (source < check.min_edge_m * check.min_edge_m) return false;
  const double ratio = check.min_edge_ratio * check.min_edge_ratio;
  return std::min(source, target) >= ratio * std::max(source, target);
}

bool normals_agree(const PairView& pair, const PlacedPair& one, const Eigen::Matrix3f& rotation,
                   const TripleCheck& check) noexcept {
  if (!pair.source->has_normal(one.source_point) || !pair.target->has_normal(one.target_point)) {
    return true;
  }
  const float cosine =
      (rotation * pair.source->normal(one.source_point)).dot(pair.target->normal(one.target_point));
  return static_cast<double>(cosine) >= check.cos_normal;
}

/// A triple of pairs, of which `draw()` gives one.
template <class Draw>
bool draw_triple(const PairView& pair, const TripleCheck& check, const Draw& draw,
                 Pose& target_from_source) noexcept {
  const PlacedPair& a = draw();
  const PlacedPair& b = draw();
  if (!edges_agree(a, b, check)) return false;
  const PlacedPair& c = draw();
  if (!edges_agree(a, c, check) || !edges_agree(b, c, check)) return false;
  PointPairSums sums;
  for (const PlacedPair* one : {&a, &b, &c}) {
    sums.add(one->source.cast<double>(), one->target.cast<double>());
  }
  target_from_source = best_rigid_motion(sums);
  const Eigen::Matrix3f rotation = target_from_source.linear().cast<float>();
  return normals_agree(pair, a, rotation, check) && normals_agree(pair, b, rotation, check) &&
         normals_agree(pair, c, rotation, check);
}

}  // namespace

bool draw_pose(const PairView& pair, const Correspondences& correspondences,
               const TripleCheck& check, Rng& rng, Pose& target_from_source) noexcept {
  const auto count = static_cast<std::uint32_t>(correspondences.size());
  const auto draw = [&] { return placed(pair, correspondences[rng.below(count)]); };
  return draw_triple(pair, check, draw, target_from_source);
}

bool draw_pose(const PairView& pair, std::span<const PlacedPair> placed, const TripleCheck& check,
               Rng& rng, Pose& target_from_source) noexcept {
  const auto count = static_cast<std::uint32_t>(placed.size());
  const auto draw = [&]() -> const PlacedPair& { return placed[rng.below(count)]; };
  return draw_triple(pair, check, draw, target_from_source);
}

void place_pairs(const PairView& pair, const Correspondences& correspondences,
                 std::span<PlacedPair> out) noexcept {
  for (std::size_t i = 0; i < correspondences.size(); ++i)
    out[i] = placed(pair, correspondences[i]);
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
