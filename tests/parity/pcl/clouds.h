#pragma once

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include "pipeline/limits.h"
#include "pipeline/surface.h"
#include "tests/pipeline/support/surfaces.h"

namespace grapnel::test {

/// The surface's points, in its order, without grid.
[[nodiscard]] pcl::PointCloud<pcl::PointXYZ>::Ptr pcl_points(const Surface& surface);
/// The same with the surface's intensities.
[[nodiscard]] pcl::PointCloud<pcl::PointXYZI>::Ptr pcl_points_with_intensity(
    const Surface& surface);
/// The surface's normals; NaN where it has none.
[[nodiscard]] pcl::PointCloud<pcl::Normal>::Ptr pcl_normals(const Surface& surface);

/// A cloud of the recorded data as a surface seen from the origin; skips the calling test where
/// there is none (the surface is then empty).
[[nodiscard]] OwnedSurface recorded_surface(const char* name);

/// Limits that hold this surface.
[[nodiscard]] Limits limits_for(const Surface& surface);

}  // namespace grapnel::test
