#pragma once

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/search/kdtree.h>

#include <limits>

#include "tests/parity/pcl/clouds.h"

namespace grapnel::bench::peers {

using Points = pcl::PointCloud<pcl::PointXYZ>;
using Normals = pcl::PointCloud<pcl::Normal>;

/// Every pixel of the surface's grid, NaN without reading.
[[nodiscard]] inline Points::Ptr organised_points(const Surface& surface) {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  const auto width = static_cast<std::uint32_t>(surface.grid.width);
  const auto height = static_cast<std::uint32_t>(surface.grid.height);
  Points::Ptr cloud(new Points(width, height, {kNan, kNan, kNan}));
  cloud->is_dense = false;
  for (std::size_t i = 0; i < surface.size; ++i) {
    (*cloud)[static_cast<std::size_t>(surface.grid.pixel_of[i])] = {surface.x[i], surface.y[i],
                                                                    surface.z[i]};
  }
  return cloud;
}

[[nodiscard]] inline pcl::search::KdTree<pcl::PointXYZ>::Ptr new_tree() {
  return pcl::search::KdTree<pcl::PointXYZ>::Ptr(new pcl::search::KdTree<pcl::PointXYZ>);
}

}  // namespace grapnel::bench::peers
