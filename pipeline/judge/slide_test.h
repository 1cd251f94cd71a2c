#pragma once

#include "pipeline/judge/overlap.h"

namespace grapnel {

/// How much of a pose's worth() is lost when one view slides along the other in the directions that
/// the overlap knows least: a plane in itself, a barrel about its axis, a corridor along itself.
/// 0 = nothing: the pose could as well be another. Both ways along each of the two weakest
/// directions, `step_m` far; turns are measured by the shift of a point `arm_m` from `centre`
/// (target frame). `information` is of the pose, at the target's origin.
[[nodiscard]] double slide_margin(const OverlapView& source, const OverlapView& target,
                                  const Pose& target_from_source, const Mat6d& information,
                                  const Vec3d& centre, double arm_m, double step_m,
                                  const OverlapTolerance& tolerance) noexcept;

}  // namespace grapnel
