#pragma once

#include <cstddef>
#include <span>

#include "base/arena.h"
#include "pipeline/stage.h"

namespace grapnel {

/// What generators do with poses that they only suppose: all of them get a glance, the best
/// distinct ones are rated in full, by the view's score.
class PoseFinalists {
 public:
  static constexpr std::size_t kKept = 96;

  void reserve(Arena& arena);
  /// Starts over. `quick_samples` of a glance; at most `ratings` poses are looked at.
  void begin(const PairView& pair, std::size_t quick_samples, std::size_t ratings) noexcept;
  /// False when no more poses are looked at.
  bool offer(const Pose& target_from_source) noexcept;
  /// Adds to `hypotheses`, best first. Errors: NoConsensus, where nothing was offered.
  Status conclude(Hypotheses& hypotheses) noexcept;

  /// Half the diagonal of the source's bounding box.
  [[nodiscard]] double radius_m() const noexcept { return radius_m_; }

 private:
  std::span<Hypothesis> storage_;
  Hypotheses kept_;
  const PoseScore* score_ = nullptr;
  Vec3d centre_ = Vec3d::Zero();  // of the source's bounding box
  double radius_m_ = 0.0;
  std::size_t quick_samples_ = 0;
  std::size_t left_ = 0;
  bool any_ = false;
};

}  // namespace grapnel
