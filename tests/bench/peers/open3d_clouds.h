#pragma once

#include <open3d/geometry/PointCloud.h>

#include <memory>

#include "pipeline/surface.h"

namespace grapnel::bench::peers::o3d {

using Cloud = open3d::geometry::PointCloud;

/// Points, and normals where `with_normals`. From the first call on Open3D has one thread.
[[nodiscard]] std::shared_ptr<Cloud> cloud_of(const Surface& surface, bool with_normals = false);

}  // namespace grapnel::bench::peers::o3d
