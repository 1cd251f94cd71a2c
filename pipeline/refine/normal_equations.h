#pragma once

#include "base/geometry.h"

namespace grapnel {

/// Gauss-Newton sums of scalar constraints on a small rigid motion of moving points: a constraint
/// says that point x should move by -residual along `direction`. The motion is (δt, δω) with
/// x' = x + δt + δω × (x - centre).
class NormalEquations {
 public:
  explicit NormalEquations(const Vec3d& centre) noexcept : centre_(centre) {}

  void add(const Vec3d& direction, const Vec3d& x, double residual_m, double weight) noexcept {
    const Vec3d arm = (x - centre_).cross(direction);
    const double j[6] = {direction.x(), direction.y(), direction.z(), arm.x(), arm.y(), arm.z()};
    int k = 0;
    for (int a = 0; a < 6; ++a) {
      const double scaled = weight * j[a];
      gradient_[a] += scaled * residual_m;
      for (int b = a; b < 6; ++b) upper_[k++] += scaled * j[b];
    }
    arm_square_ += weight * (x - centre_).squaredNorm();
    weight_ += weight;
  }

  /// Adds sums made elsewhere, about the same centre: the upper triangle of Σ w J Jᵀ row by row,
  /// Σ w J residual, Σ w lever² and Σ w.
  void add_sums(const double (&upper)[21], const double (&gradient)[6], double arm_square,
                double weight) noexcept {
    for (int k = 0; k < 21; ++k) upper_[k] += upper[k];
    for (int a = 0; a < 6; ++a) gradient_[a] += gradient[a];
    arm_square_ += arm_square;
    weight_ += weight;
  }

  /// Adds what other equations say of the opposite motion in another frame, about the same centre:
  /// there points move toward a surface, here the surface toward the points. `rotation` turns
  /// directions from that frame into this one.
  void add_opposite(const NormalEquations& other, const Mat3d& rotation) noexcept;

  /// The step (δt, δω). Lengths and angles are made comparable by the points' mean distance from
  /// the centre; directions whose eigenvalue is below `freeze_ratio` of the largest are left alone.
  [[nodiscard]] Vec6d solve(double freeze_ratio) const noexcept;

  /// Information about (δt, δω) with the rotation taken about the frame's origin.
  [[nodiscard]] Mat6d information_at_origin() const noexcept;
  [[nodiscard]] double weight() const noexcept { return weight_; }
  [[nodiscard]] const Vec3d& centre() const noexcept { return centre_; }

 private:
  [[nodiscard]] Mat6d matrix() const noexcept;

  Vec3d centre_;
  double upper_[21] = {};
  double gradient_[6] = {};
  double arm_square_ = 0.0;
  double weight_ = 0.0;
};

/// `pose` followed by the motion (δt, δω) about `centre`.
[[nodiscard]] Pose moved(const Pose& pose, const Vec6d& step, const Vec3d& centre) noexcept;

/// Information about the left perturbation of a pose, carried over to the pose's inverse.
[[nodiscard]] Mat6d information_of_inverse(const Mat6d& information, const Pose& pose) noexcept;

/// [v]×, so that skew(v) w = v × w.
[[nodiscard]] Mat3d skew(const Vec3d& v) noexcept;

}  // namespace grapnel
