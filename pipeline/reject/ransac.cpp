#include "pipeline/reject/ransac.h"

#include <array>

#include "pipeline/coarse/kabsch.h"
#include "pipeline/coarse/triples.h"

namespace grapnel {
namespace {

struct Ends {
  Vec3d source;
  Vec3d target;
};

Ends ends(const PairView& pair, const Correspondence& c) noexcept {
  const auto s =
      static_cast<std::size_t>(pair.source_keypoints[static_cast<std::size_t>(c.source)].point);
  const auto t =
      static_cast<std::size_t>(pair.target_keypoints[static_cast<std::size_t>(c.target)].point);
  return {pair.source->point(s).cast<double>(), pair.target->point(t).cast<double>()};
}

std::size_t count_inliers(const PairView& pair, const Correspondences& correspondences,
                          const Pose& pose, double square_m2, PointPairSums* sums) noexcept {
  std::size_t inliers = 0;
  for (const Correspondence& c : correspondences) {
    const Ends e = ends(pair, c);
    if ((pose * e.source - e.target).squaredNorm() > square_m2) continue;
    ++inliers;
    if (sums != nullptr) sums->add(e.source, e.target);
  }
  return inliers;
}

}  // namespace

FieldTable ransac_rejector_fields() noexcept {
  using P = RansacRejectorParams;
  static constexpr std::array kFields = {
      number_field<&P::draws>("draws", "", 1, 10000000, "triples of pairs tried"),
      number_field<&P::inlier_distance_m>("inlier_distance_m", "m", 0.0, 10.0,
                                          "an inlier's distance; 0 = 1.5 × the target's spacing"),
  };
  return kFields;
}

Status RansacRejector::reject(const PairView& pair, Correspondences& correspondences,
                              Rng& rng) noexcept {
  if (correspondences.size() < 3) {
    return Error{Code::TooFewCorrespondences, Stage::Reject,
                 static_cast<std::int32_t>(correspondences.size())};
  }
  const double distance_m =
      params_.inlier_distance_m > 0.0 ? params_.inlier_distance_m : 1.5 * pair.target->spacing_m;
  const double square_m2 = distance_m * distance_m;
  TripleCheck check;
  check.min_edge_m = distance_m;
  check.min_edge_ratio = 0.5;
  check.cos_normal = -1.0;
  Pose best = Pose::Identity();
  std::size_t most = 0;
  for (std::size_t draw = 0; draw < params_.draws; ++draw) {
    Pose pose;
    if (!draw_pose(pair, correspondences, check, rng, pose)) continue;
    const std::size_t inliers = count_inliers(pair, correspondences, pose, square_m2, nullptr);
    if (inliers <= most) continue;
    most = inliers;
    best = pose;
  }
  if (most < 3) return Error{Code::NoConsensus, Stage::Reject, static_cast<std::int32_t>(most)};
  PointPairSums sums;
  count_inliers(pair, correspondences, best, square_m2, &sums);
  const Pose refined = best_rigid_motion(sums);
  if (count_inliers(pair, correspondences, refined, square_m2, nullptr) >= most) best = refined;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < correspondences.size(); ++i) {
    const Ends e = ends(pair, correspondences[i]);
    if ((best * e.source - e.target).squaredNorm() <= square_m2) {
      correspondences[kept++] = correspondences[i];
    }
  }
  correspondences.resize(kept);
  return {};
}

}  // namespace grapnel
