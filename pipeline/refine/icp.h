#pragma once

#include <cstddef>
#include <cstdint>

#include "base/field.h"
#include "pipeline/stage.h"

namespace grapnel {

/// Distances are multiples of the fixed surface's spacing, so that one set of values serves a room
/// and a part under a microscope.
struct IcpParams {
  enum class Metric : std::uint8_t { PointToPlane, PointToPoint, Symmetric };
  Metric metric = Metric::PointToPlane;
  int max_iterations = 30;
  std::size_t max_points = 2000;
  double start_distance_ratio = 4.0;
  double end_distance_ratio = 1.5;
  int anneal_iterations = 8;
  double max_normal_angle_rad = 0.9;
  double convergence_m = 2e-5;
  double convergence_rad = 2e-5;
  double freeze_ratio = 0.003;
};
[[nodiscard]] FieldTable icp_fields() noexcept;

/// Iterative closest point: Besl and McKay 1992; point-to-plane after Chen and Medioni 1991, or
/// with both points' normals (Rusinkiewicz 2019); with Geman and McClure's weight. The partners'
/// distance limit shrinks geometrically from start to end over the first iterations; as long as it
/// does, near partners do for the nearest. Directions the partners do not fix stay as they were.
class Icp final : public PoseRefiner {
 public:
  explicit Icp(const IcpParams& params) : params_(params) {}

  void reserve(Arena&, const Limits&) override {}
  Result<RefinedPose> refine(const Surface& moving, const Surface& fixed,
                             const ClosestSurface& closest,
                             const Pose& fixed_from_moving) noexcept override;

 private:
  IcpParams params_;
};

}  // namespace grapnel
