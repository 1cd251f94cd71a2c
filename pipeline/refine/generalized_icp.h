#pragma once

#include <cstddef>

#include "base/field.h"
#include "pipeline/neighbours/neighbour_search.h"
#include "pipeline/stage.h"

namespace grapnel {

struct GeneralizedIcpParams {
  int max_iterations = 30;
  std::size_t max_points = 0;   ///< of the moving surface, spread evenly; 0: all (PCL)
  double max_distance_m = 0.0;  ///< of partners; 0 = auto: max_distance_ratio spacings
  double max_distance_ratio = 4.0;
  /// Distance that the whole range of intensity counts as in the choice of a partner; 0: colour is
  /// not looked at. What is printed on a part then fixes what its shape leaves free.
  double intensity_m = 0.0;
  double normal_variance = 0.001;  ///< across the surface, where along it is 1 (PCL: 0.001)
  double kernel_ratio = 0.0;       ///< of the robust weight, × max distance; 0: none (PCL)
  double convergence_m = 2e-5;
  double convergence_rad = 2e-5;
};
[[nodiscard]] FieldTable generalized_icp_fields() noexcept;

/// Generalized ICP (Segal, Haehnel and Thrun 2009), plane to plane: both points' positions are
/// uncertain along their surfaces, and each pair counts by the inverse of the sum of both. A point
/// without a normal is taken as a ball. Gauss-Newton, in double. With intensity_m the partner is
/// the nearest in place and intensity (Servos and Waslander 2014, PCL's variant of six dimensions),
/// looked for among all points within the distance: O(n · neighbours) an iteration.
class GeneralizedIcp final : public PoseRefiner {
 public:
  explicit GeneralizedIcp(const GeneralizedIcpParams& params) : params_(params) {}

  void reserve(Arena& arena, const Limits& limits) override;
  Result<RefinedPose> refine(const Surface& moving, const Surface& fixed,
                             const ClosestSurface& closest,
                             const Pose& fixed_from_moving) noexcept override;

 private:
  /// Index of the fixed point that `moving_i`, now at `x`, belongs to; -1 = none.
  [[nodiscard]] std::int32_t partner_of(const Surface& moving, std::size_t moving_i,
                                        const Surface& fixed, const Vec3f& x,
                                        const ClosestSurface& closest, float reach_m) noexcept;

  GeneralizedIcpParams params_;
  NeighbourSearch search_;
};

}  // namespace grapnel
