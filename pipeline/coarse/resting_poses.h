#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "base/field.h"
#include "base/fixed_list.h"
#include "pipeline/coarse/pose_finalists.h"
#include "pipeline/stage.h"

namespace grapnel {

struct RestingPosesParams {
  std::size_t yaws = 36;           ///< turns tried about the ground's normal
  std::size_t slides = 2;          ///< shifts along the ground toward the measured surface
  std::size_t quick_samples = 48;  ///< of a first rating
};
[[nodiscard]] FieldTable resting_poses_fields() noexcept;

/// Poses of a part that stands on the ground: which side it rests on, how it is turned and where it
/// lies, three numbers and a class instead of six. The sides are where the reach from the part's
/// middle is least; the part's place follows from the middle of what should be seen of it, then
/// from the way to its nearest surface. Needs the view's score and ground; correspondences are not
/// looked at. The last source's sides are kept.
class RestingPoses final : public HypothesisGenerator {
 public:
  explicit RestingPoses(const RestingPosesParams& params) : params_(params) {}

  void reserve(Arena& arena, const Limits& limits) override;
  [[nodiscard]] bool supports_by_score() const noexcept override { return true; }
  [[nodiscard]] bool needs_correspondences() const noexcept override { return false; }
  /// Errors: NoConsensus, also where the ground is unknown.
  Status generate(const PairView& pair, const Correspondences& correspondences, Rng& rng,
                  Hypotheses& hypotheses) noexcept override;

  /// Where a part may rest: the direction that then points down, in its own frame.
  struct Side {
    Vec3d down = Vec3d::UnitZ();
    double reach_m = 0.0;  ///< of its points along `down`, from the frame's origin
  };
  /// At most 16. O(points).
  void find_sides(const Surface& source) noexcept;
  [[nodiscard]] std::span<const Side> sides() const noexcept { return sides_.span(); }

 private:
  void try_side(const PairView& pair, const Side& side, const Vec3d& middle) noexcept;
  [[nodiscard]] Vec3d seen_middle(const Surface& source, const Mat3d& rotation,
                                  const Vec3d& toward_camera) const noexcept;

  RestingPosesParams params_;
  PoseFinalists finalists_;
  std::span<double> reach_m_;  // of every direction, while the sides are found
  InlineList<Side, 16> sides_;
  std::uint64_t learned_ = 0;
};

}  // namespace grapnel
