#include "pipeline/reject/ransac.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "base/math.h"
#include "pipeline/kernels/rigid_pairs.h"

namespace grapnel {
namespace {

kernels::RigidMotion in_float(const Pose& pose) noexcept {
  kernels::RigidMotion motion;
  for (Eigen::Index row = 0; row < 3; ++row) {
    for (Eigen::Index column = 0; column < 3; ++column) {
      motion.r[3 * row + column] = static_cast<float>(pose.linear()(row, column));
    }
    motion.t[row] = static_cast<float>(pose.translation()[row]);
  }
  return motion;
}

/// The same arithmetic as the kernel's, so that both agree on what an inlier is.
bool is_inlier(const kernels::RigidMotion& m, const Vec3f& s, const Vec3f& t,
               float square_m2) noexcept {
  std::array<float, 3> off{};
  for (std::size_t i = 0; i < 3; ++i) {
    const float* r = m.r + 3 * i;
    off[i] =
        ((r[0] * s.x() + r[1] * s.y()) + (r[2] * s.z() + m.t[i])) - t[static_cast<Eigen::Index>(i)];
  }
  return (off[0] * off[0] + off[1] * off[1]) + off[2] * off[2] <= square_m2;
}

}  // namespace

FieldTable ransac_rejector_fields() noexcept {
  using P = RansacRejectorParams;
  static constexpr std::array kFields = {
      number_field<&P::draws>("draws", "", 1, 10000000, "triples of pairs tried"),
      number_field<&P::inlier_distance_m>("inlier_distance_m", "m", 0.0, 10.0,
                                          "an inlier's distance; 0 = 1.5 × the target's spacing"),
      number_field<&P::confidence>("confidence", "", 0.5, 1.0,
                                   "probability at which no better motion is expected; 1 = all "
                                   "draws"),
      number_field<&P::refits>("refits", "", 0, 100, "of each new best motion to its inliers"),
  };
  return kFields;
}

void RansacRejector::reserve(Arena& arena, const Limits& limits) {
  ends_.reserve(arena, limits.max_correspondences);
}

bool RansacRejector::draw(float distance_m, Rng& rng, PointPairSums& sums) noexcept {
  std::array<Vec3f, 3> s, t;
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t i = rng.below(static_cast<std::uint32_t>(ends_.size()));
    s[k] = ends_.source(i);
    t[k] = ends_.target(i);
    for (std::size_t j = 0; j < k; ++j) {
      const float source_m = (s[k] - s[j]).norm();
      const float target_m = (t[k] - t[j]).norm();
      // Written so that places which are no numbers fail.
      if (!(std::min(source_m, target_m) >= distance_m)) return false;
      if (!(std::fabs(source_m - target_m) <= 2.0F * distance_m)) return false;
    }
  }
  for (std::size_t k = 0; k < 3; ++k) sums.add(s[k].cast<double>(), t[k].cast<double>());
  return true;
}

std::size_t RansacRejector::rate(const Pose& pose, float square_m2,
                                 std::size_t to_beat) const noexcept {
  return kernels::count_inliers(ends_.planes(), ends_.size(), in_float(pose), square_m2, to_beat);
}

void RansacRejector::optimise(Motion& best, float square_m2) const noexcept {
  for (std::size_t round = 0; round < params_.refits; ++round) {
    const kernels::RigidMotion motion = in_float(best.target_from_source);
    PointPairSums sums;
    for (std::size_t i = 0; i < ends_.size(); ++i) {
      const Vec3f s = ends_.source(i);
      const Vec3f t = ends_.target(i);
      if (is_inlier(motion, s, t, square_m2)) sums.add(s.cast<double>(), t.cast<double>());
    }
    if (sums.weight < 3.0) return;
    const Pose refit = best_rigid_motion(sums);
    const std::size_t inliers = rate(refit, square_m2, best.inliers);
    if (inliers <= best.inliers) return;
    best = {refit, inliers};
  }
}

std::size_t RansacRejector::enough(std::size_t inliers) const noexcept {
  if (params_.confidence >= 1.0) return std::numeric_limits<std::size_t>::max();
  const double share = static_cast<double>(inliers) / static_cast<double>(ends_.size());
  const double miss = 1.0 - share * share * share;
  if (miss <= 0.0) return 1;
  const double draws = math::log(1.0 - params_.confidence) / math::log(miss);
  return draws < 1e9 ? static_cast<std::size_t>(draws) + 1 : std::size_t{1000000000};
}

Status RansacRejector::reject(const PairView& pair, Correspondences& correspondences,
                              Rng& rng) noexcept {
  const auto given = static_cast<std::int32_t>(correspondences.size());
  if (given < 3) return Error{Code::TooFewCorrespondences, Stage::Reject, given};
  if (!ends_.gather(pair, correspondences)) {
    return Error{Code::CapacityExceeded, Stage::Reject, given};
  }
  const auto distance_m = static_cast<float>(
      params_.inlier_distance_m > 0.0 ? params_.inlier_distance_m : 1.5 * pair.target->spacing_m);
  const float square_m2 = distance_m * distance_m;
  Motion best;
  rated_ = 0;
  std::size_t draws = params_.draws;
  for (std::size_t i = 0; i < draws; ++i) {
    PointPairSums sums;
    if (!draw(distance_m, rng, sums)) continue;
    ++rated_;
    Motion drawn;
    drawn.target_from_source = best_rigid_motion(sums);
    drawn.inliers = rate(drawn.target_from_source, square_m2, best.inliers);
    if (drawn.inliers <= best.inliers) continue;
    best = drawn;
    optimise(best, square_m2);
    draws = std::min(draws, enough(best.inliers));
  }
  if (best.inliers < 3) {
    return Error{Code::NoConsensus, Stage::Reject, static_cast<std::int32_t>(best.inliers)};
  }
  const kernels::RigidMotion motion = in_float(best.target_from_source);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < ends_.size(); ++i) {
    if (is_inlier(motion, ends_.source(i), ends_.target(i), square_m2)) {
      correspondences[kept++] = correspondences[i];
    }
  }
  correspondences.resize(kept);
  return {};
}

}  // namespace grapnel
