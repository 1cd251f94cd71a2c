#pragma once

#include <array>
#include <cstddef>

#include "base/geometry.h"

namespace grapnel {

/// Which motions a set of surface points would notice, by point-to-plane distance: Σ j jᵀ with
/// j = (n, (p - centre) / arm × n), so that turns are measured by the shift of a point one arm
/// away.
class MotionSums {
 public:
  /// `arm_m`: typical distance of the points from `centre`, above 0.
  MotionSums(const Vec3d& centre, double arm_m) noexcept;

  void add(const Vec3f& point, const Vec3f& normal) noexcept;
  void add(const MotionSums& other) noexcept;
  [[nodiscard]] Mat6d matrix() const noexcept;

 private:
  static constexpr std::size_t kUpper = 21;  // of a symmetric 6 × 6
  Vec3f centre_ = Vec3f::Zero();
  float per_arm_ = 0.0F;
  std::array<double, kUpper> upper_{};
};

/// The share of `all` that `part` is, in the motion where it is least: the smallest generalised
/// eigenvalue, 0 to 1, of sums of which `part` is contained in `all`. A floor that fills the image
/// fits under any turn about its normal: nine of ten points match, yet hardly anything that
/// notices the turn does. Motions that next to nothing notices count as matched: about them it says
/// nothing, and the predicted deviation does.
[[nodiscard]] double least_matched_share(const MotionSums& part, const MotionSums& all) noexcept;

}  // namespace grapnel
