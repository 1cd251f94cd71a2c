#pragma once

#include "pipeline/features.h"

namespace grapnel {

/// Inserts by support, largest first, equal ones in the order of arrival; a full list drops its
/// weakest. Returns false when nothing was inserted. By contract a best-n list: no overflow mark.
bool keep_best(Hypotheses& list, const Hypothesis& hypothesis) noexcept;

/// Mean displacement of a body around `centre` with radius `radius_m` between two poses of it.
[[nodiscard]] double displacement_m(const Pose& a, const Pose& b, const Vec3d& centre,
                                    double radius_m) noexcept;

}  // namespace grapnel
