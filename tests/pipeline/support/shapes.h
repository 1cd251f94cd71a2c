#pragma once

#include "base/geometry.h"
#include "tests/pipeline/support/surfaces.h"

namespace grapnel::test {

inline constexpr double kShapeSpacing_m = 0.01;

/// A box about the origin, six faces with outward normals, every kShapeSpacing_m.
[[nodiscard]] OwnedSurface box_surface(const Vec3d& size_m);
/// A barrel about z with its lids.
[[nodiscard]] OwnedSurface barrel_surface(double radius_m, double height_m);
/// What a camera at the origin sees of a convex surface at the pose, with noise along the rays.
[[nodiscard]] OwnedSurface seen(const Surface& model, const Pose& camera_from_model,
                                double sigma_m);

}  // namespace grapnel::test
