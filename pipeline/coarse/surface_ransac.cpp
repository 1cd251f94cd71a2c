#include "pipeline/coarse/surface_ransac.h"

#include <algorithm>
#include <array>

#include "base/math.h"
#include "pipeline/coarse/hypothesis_list.h"
#include "pipeline/coarse/pose_score.h"

namespace grapnel {
namespace {

// Pairs whose points a pose brings within so many spacings meet.
constexpr double kNear = 2.0;
// A pose met by fewer pairs than this part of another's is no rival of it.
constexpr double kRival = 0.5;

}  // namespace

FieldTable surface_ransac_fields() noexcept {
  using P = SurfaceRansacParams;
  static constexpr std::array kFields = {
      number_field<&P::draws>("draws", "", 0, 10000000, "triples of pairs tried; 0 = off"),
      number_field<&P::ratings>("ratings", "", 1, 1000000, "poses rated at the most"),
      number_field<&P::quick_samples>("quick_samples", "", 16, 4096, "samples of the first rating"),
      number_field<&P::min_edge_ratio>("min_edge_ratio", "", 0.1, 1.0,
                                       "shorter over longer of two corresponding edges"),
      number_field<&P::min_extent_share>("min_extent_share", "", 0.0, 1.0,
                                         "shortest edge of a triple, share of the extent"),
      number_field<&P::max_normal_angle_rad>("max_normal_angle_rad", "rad", 0.05, 3.2,
                                             "partners' normals differ by at most this"),
      number_field<&P::confidence>("confidence", "", 0.5, 1.0,
                                   "of a right triple drawn, at which drawing ends; 1 = never"),
  };
  return kFields;
}

void SurfaceRansac::reserve(Arena& arena, const Limits& limits) {
  placed_ = arena.take<PlacedPair>(limits.max_correspondences);
}

/// Draws after which a triple of a pose that as large a part of the pairs meets as kRival of those
/// that meet this one has been drawn with the wanted confidence.
std::size_t SurfaceRansac::draws_for(const PairView& pair, const Correspondences& correspondences,
                                     const Pose& target_from_source) const noexcept {
  const Eigen::Matrix3f rotation = target_from_source.linear().cast<float>();
  const Vec3f shift = target_from_source.translation().cast<float>();
  const auto near_m = static_cast<float>(kNear * pair.target->spacing_m);
  std::size_t met = 0;
  for (const Correspondence& c : correspondences) {
    const auto source = pair.source_keypoints[static_cast<std::size_t>(c.source)].point;
    const auto target = pair.target_keypoints[static_cast<std::size_t>(c.target)].point;
    const Vec3f off = rotation * pair.source->point(static_cast<std::size_t>(source)) + shift -
                      pair.target->point(static_cast<std::size_t>(target));
    met += off.squaredNorm() <= near_m * near_m ? 1 : 0;
  }
  const double share =
      kRival * static_cast<double>(met) / static_cast<double>(correspondences.size());
  const double missed = math::log(1.0 - share * share * share);
  const double draws = missed < 0.0 ? math::log(1.0 - params_.confidence) / missed : 1e18;
  return static_cast<std::size_t>(std::min(draws, 1e9)) + 1;
}

Status SurfaceRansac::generate(const PairView& pair, const Correspondences& correspondences,
                               Rng& rng, Hypotheses& hypotheses) noexcept {
  if (pair.score == nullptr) return Error{Code::BadParameter, Stage::Coarse, 0};
  if (correspondences.size() < 3) {
    return Error{Code::TooFewCorrespondences, Stage::Coarse,
                 static_cast<std::int32_t>(correspondences.size())};
  }
  TripleCheck check;
  check.min_edge_m = params_.min_extent_share * extent_m(*pair.source, pair.source_keypoints);
  check.min_edge_ratio = params_.min_edge_ratio;
  check.cos_normal = math::cos(params_.max_normal_angle_rad);
  // Few pairs have few triples; drawing each more than a few times is of no use.
  const std::size_t pairs = correspondences.size();
  if (pairs > placed_.size()) {
    return Error{Code::CapacityExceeded, Stage::Coarse, static_cast<std::int32_t>(pairs)};
  }
  const std::span<PlacedPair> placed = placed_.first(pairs);
  place_pairs(pair, correspondences, placed);
  std::size_t draws = std::min(params_.draws, pairs * pairs * pairs);
  std::size_t rated = 0;
  for (std::size_t draw = 0; draw < draws && rated < params_.ratings; ++draw) {
    Hypothesis hypothesis;
    if (!draw_pose(pair, placed, check, rng, hypothesis.target_from_source)) continue;
    ++rated;
    const double weakest = hypotheses.full() ? hypotheses[hypotheses.size() - 1].support : -1e9;
    // A quick rating scatters by about a tenth.
    if (pair.score->glance(hypothesis.target_from_source, params_.quick_samples, weakest - 0.15) <
        weakest - 0.15) {
      continue;
    }
    hypothesis.support = (*pair.score)(hypothesis.target_from_source, SIZE_MAX);
    const bool best = hypotheses.size() == 0 || hypothesis.support > hypotheses[0].support;
    if (best && params_.confidence < 1.0) {
      draws = std::min(draws, draws_for(pair, correspondences, hypothesis.target_from_source));
    }
    keep_best(hypotheses, hypothesis);
  }
  if (rated == 0) return Error{Code::NoConsensus, Stage::Coarse, 0};
  return {};
}

}  // namespace grapnel
