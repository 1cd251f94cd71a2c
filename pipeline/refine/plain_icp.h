#pragma once

#include <cstddef>

#include "base/field.h"
#include "pipeline/stage.h"

namespace grapnel {

struct PlainIcpParams {
  enum class Metric : std::uint8_t { PointToPoint, PointToPlane };
  Metric metric = Metric::PointToPoint;
  int max_iterations = 50;
  std::size_t max_points = 0;   ///< of the moving surface, spread evenly; 0: all (PCL)
  double max_distance_m = 0.0;  ///< of partners; 0 = auto: max_distance_ratio spacings
  double max_distance_ratio = 10.0;
  double transformation_epsilon_m2 = 1e-8;  ///< on the squared translation of a step, as in PCL
  double min_rotation_cos = 0.99999999;     ///< and on the cosine of its angle
  double relative_mse = 0.0;                ///< a smaller relative change of the mean square ends
};
[[nodiscard]] FieldTable plain_icp_fields() noexcept;

/// Iterative closest point to the field's letter: every point, nearest partners within one
/// distance, equal weights, the closed form (point to point) or the linear least squares of small
/// angles (point to plane), and the stops of PCL 1.13's DefaultConvergenceCriteria. What `icp` is
/// compared with.
class PlainIcp final : public PoseRefiner {
 public:
  explicit PlainIcp(const PlainIcpParams& params) : params_(params) {}

  void reserve(Arena&, const Limits&) override {}
  Result<RefinedPose> refine(const Surface& moving, const Surface& fixed,
                             const ClosestSurface& closest,
                             const Pose& fixed_from_moving) noexcept override;

 private:
  PlainIcpParams params_;
};

}  // namespace grapnel
