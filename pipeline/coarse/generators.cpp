#include "pipeline/coarse/generators.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "pipeline/coarse/hypothesis_list.h"
#include "pipeline/coarse/kabsch.h"
#include "pipeline/coarse/triples.h"

namespace grapnel {
namespace {

struct PairPoints {
  Vec3d source, target;
};

PairPoints points_of(const PairView& pair, const Correspondence& correspondence) noexcept {
  const Keypoint& s = pair.source_keypoints[static_cast<std::size_t>(correspondence.source)];
  const Keypoint& t = pair.target_keypoints[static_cast<std::size_t>(correspondence.target)];
  return {pair.source->point(static_cast<std::size_t>(s.point)).cast<double>(),
          pair.target->point(static_cast<std::size_t>(t.point)).cast<double>()};
}

/// Pairs that the pose brings together, and the sums of those.
struct Support {
  std::size_t inliers = 0;
  PointPairSums sums;
};
Support support_of(const PairView& pair, const Correspondences& correspondences, const Pose& pose,
                   double inlier_m) noexcept {
  Support support;
  for (const Correspondence& correspondence : correspondences) {
    const PairPoints points = points_of(pair, correspondence);
    if ((pose * points.source - points.target).squaredNorm() > inlier_m * inlier_m) continue;
    support.sums.add(points.source, points.target);
    ++support.inliers;
  }
  return support;
}

/// Keeps the better of poses that are much the same.
void keep_distinct(const Surface& source, double distinct_m, const Hypothesis& hypothesis,
                   Hypotheses& hypotheses) noexcept {
  Vec3d low = source.point(0).cast<double>();
  Vec3d high = low;
  for (std::size_t i = 1; i < source.size; ++i) {
    low = low.cwiseMin(source.point(i).cast<double>());
    high = high.cwiseMax(source.point(i).cast<double>());
  }
  const Vec3d centre = 0.5 * (low + high);
  const double radius_m = 0.5 * (high - low).norm();
  for (std::size_t i = 0; i < hypotheses.size(); ++i) {
    Hypothesis& other = hypotheses[i];
    if (displacement_m(hypothesis.target_from_source, other.target_from_source, centre, radius_m) >
        distinct_m) {
      continue;
    }
    if (!(hypothesis.support > other.support)) return;
    for (std::size_t k = i + 1; k < hypotheses.size(); ++k) hypotheses[k - 1] = hypotheses[k];
    hypotheses.resize(hypotheses.size() - 1);
    break;
  }
  keep_best(hypotheses, hypothesis);
}

double or_spacings(double distance_m, double ratio, const PairView& pair) noexcept {
  return distance_m > 0.0 ? distance_m
                          : ratio * std::max(pair.source->spacing_m, pair.target->spacing_m);
}

Status too_few(const Correspondences& correspondences) noexcept {
  return Error{Code::TooFewCorrespondences, Stage::Coarse,
               static_cast<std::int32_t>(correspondences.size())};
}

}  // namespace

FieldTable svd_fields() noexcept {
  using P = SvdParams;
  static constexpr std::array kFields = {
      number_field<&P::inlier_m>("inlier_m", "m", 0.0, 100.0, "0 = inlier_ratio spacings"),
      number_field<&P::inlier_ratio>("inlier_ratio", "spacings", 0.1, 1000.0,
                                     "pairs nearer than this support a pose"),
  };
  return kFields;
}

Status SvdGenerator::generate(const PairView& pair, const Correspondences& correspondences, Rng&,
                              Hypotheses& hypotheses) noexcept {
  if (correspondences.size() < 3) return too_few(correspondences);
  PointPairSums sums;
  for (const Correspondence& correspondence : correspondences) {
    const PairPoints points = points_of(pair, correspondence);
    sums.add(points.source, points.target);
  }
  Hypothesis hypothesis;
  hypothesis.target_from_source = best_rigid_motion(sums);
  if (!hypothesis.target_from_source.matrix().allFinite()) {
    return Error{Code::NoConsensus, Stage::Coarse, 0};
  }
  const double inlier_m = or_spacings(params_.inlier_m, params_.inlier_ratio, pair);
  hypothesis.support = static_cast<double>(
      support_of(pair, correspondences, hypothesis.target_from_source, inlier_m).inliers);
  keep_best(hypotheses, hypothesis);
  return {};
}

FieldTable ransac_generator_fields() noexcept {
  using P = RansacGeneratorParams;
  static constexpr std::array kFields = {
      number_field<&P::draws>("draws", "", 1, 10000000, "triples of pairs tried"),
      number_field<&P::inlier_m>("inlier_m", "m", 0.0, 100.0, "0 = inlier_ratio spacings"),
      number_field<&P::inlier_ratio>("inlier_ratio", "spacings", 0.1, 1000.0,
                                     "pairs nearer than this support a pose"),
      number_field<&P::min_edge_ratio>("min_edge_ratio", "", 0.0, 1.0,
                                       "shorter over longer of two corresponding edges"),
      number_field<&P::min_extent_share>("min_extent_share", "", 0.0, 1.0,
                                         "shortest edge of a triple over the keypoints' extent"),
      number_field<&P::distinct_ratio>("distinct_ratio", "", 0.0, 1000.0,
                                       "poses farther apart than this × inlier_m are distinct"),
  };
  return kFields;
}

Status RansacGenerator::generate(const PairView& pair, const Correspondences& correspondences,
                                 Rng& rng, Hypotheses& hypotheses) noexcept {
  if (correspondences.size() < 3) return too_few(correspondences);
  const double inlier_m = or_spacings(params_.inlier_m, params_.inlier_ratio, pair);
  TripleCheck check;
  check.min_edge_m = params_.min_extent_share * extent_m(*pair.source, pair.source_keypoints);
  check.min_edge_ratio = params_.min_edge_ratio;
  check.cos_normal = -1.0;
  std::size_t best = 3;
  bool found = false;
  for (int draw = 0; draw < params_.draws; ++draw) {
    Pose pose = Pose::Identity();
    if (!draw_pose(pair, correspondences, check, rng, pose)) continue;
    Support support = support_of(pair, correspondences, pose, inlier_m);
    if (2 * support.inliers < best || support.inliers < 3) continue;
    // Promising: fitted to all of its pairs, as long as that brings more together.
    for (int round = 0; round < 5; ++round) {
      const Pose fitted = best_rigid_motion(support.sums);
      const Support again = support_of(pair, correspondences, fitted, inlier_m);
      if (again.inliers < support.inliers) break;
      const bool more = again.inliers > support.inliers;
      pose = fitted;
      support = again;
      if (!more) break;
    }
    best = std::max(best, support.inliers);
    found = true;
    keep_distinct(*pair.source, params_.distinct_ratio * inlier_m,
                  {pose, static_cast<double>(support.inliers)}, hypotheses);
  }
  if (!found) return Error{Code::NoConsensus, Stage::Coarse, params_.draws};
  return {};
}

FieldTable sample_consensus_fields() noexcept {
  using P = SampleConsensusParams;
  static constexpr std::array kFields = {
      number_field<&P::draws>("draws", "", 1, 10000000, "triples tried"),
      number_field<&P::max_distance_m>("max_distance_m", "m", 0.0, 100.0,
                                       "0 = max_distance_ratio spacings"),
      number_field<&P::max_distance_ratio>("max_distance_ratio", "spacings", 0.1, 10000.0,
                                           "at which a point's error is cut off"),
      number_field<&P::min_extent_share>("min_extent_share", "", 0.0, 1.0,
                                         "shortest edge of a triple over the keypoints' extent"),
      number_field<&P::rated_points>("rated_points", "", 0, 1000000,
                                     "points of the source that rate a pose; 0: all"),
      number_field<&P::distinct_ratio>("distinct_ratio", "", 0.0, 1000.0,
                                       "poses farther apart than this × max_distance are distinct"),
  };
  return kFields;
}

void SampleConsensus::reserve(Arena& arena, const Limits& limits) {
  closest_.reserve(arena, std::max(limits.max_points, limits.max_model_points));
}

double SampleConsensus::support(const Surface& source, const Surface& target, const Pose& pose,
                                float cut_m) const noexcept {
  const std::size_t step =
      params_.rated_points == 0
          ? 1
          : std::max<std::size_t>(1, source.size / static_cast<std::size_t>(params_.rated_points));
  double error = 0.0;
  std::size_t count = 0;
  for (std::size_t i = 0; i < source.size; i += step, ++count) {
    const Vec3f p = (pose * source.point(i).cast<double>()).cast<float>();
    const std::int32_t found = closest_.closest(p, cut_m);
    error += found < 0 ? 1.0
                       : static_cast<double>(
                             (target.point(static_cast<std::size_t>(found)) - p).norm() / cut_m);
  }
  return 1.0 - error / static_cast<double>(count);
}

Status SampleConsensus::generate(const PairView& pair, const Correspondences& correspondences,
                                 Rng& rng, Hypotheses& hypotheses) noexcept {
  if (correspondences.size() < 3) return too_few(correspondences);
  const double cut_m = or_spacings(params_.max_distance_m, params_.max_distance_ratio, pair);
  if (!(cut_m > 0.0)) return Error{Code::BadParameter, Stage::Coarse, 0};
  if (const Status status = closest_.build(*pair.target, 0.25 * cut_m); !status.ok()) {
    return Error{status.error().code, Stage::Coarse, status.error().detail};
  }
  TripleCheck check;
  check.min_edge_m = params_.min_extent_share * extent_m(*pair.source, pair.source_keypoints);
  check.min_edge_ratio = 0.0;
  check.cos_normal = -1.0;
  bool found = false;
  for (int draw = 0; draw < params_.draws; ++draw) {
    Pose pose = Pose::Identity();
    if (!draw_pose(pair, correspondences, check, rng, pose)) continue;
    const double worth = support(*pair.source, *pair.target, pose, static_cast<float>(cut_m));
    if (!(worth > 0.0)) continue;
    found = true;
    if (hypotheses.full() && worth <= hypotheses[hypotheses.size() - 1].support) continue;
    keep_distinct(*pair.source, params_.distinct_ratio * cut_m, {pose, worth}, hypotheses);
  }
  if (!found) return Error{Code::NoConsensus, Stage::Coarse, params_.draws};
  return {};
}

}  // namespace grapnel
