#include "tests/parity/pcl/clouds.h"

#include <algorithm>
#include <limits>

#include "base/cloud_file.h"
#include "tests/support/recorded_data.h"

namespace grapnel::test {

pcl::PointCloud<pcl::PointXYZ>::Ptr pcl_points(const Surface& surface) {
  pcl::PointCloud<pcl::PointXYZ>::Ptr cloud(new pcl::PointCloud<pcl::PointXYZ>);
  for (std::size_t i = 0; i < surface.size; ++i) {
    cloud->push_back({surface.x[i], surface.y[i], surface.z[i]});
  }
  return cloud;
}

pcl::PointCloud<pcl::PointXYZI>::Ptr pcl_points_with_intensity(const Surface& surface) {
  pcl::PointCloud<pcl::PointXYZI>::Ptr cloud(new pcl::PointCloud<pcl::PointXYZI>);
  for (std::size_t i = 0; i < surface.size; ++i) {
    pcl::PointXYZI point;
    point.x = surface.x[i];
    point.y = surface.y[i];
    point.z = surface.z[i];
    point.intensity = surface.intensity[i];
    cloud->push_back(point);
  }
  return cloud;
}

pcl::PointCloud<pcl::Normal>::Ptr pcl_normals(const Surface& surface) {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  pcl::PointCloud<pcl::Normal>::Ptr cloud(new pcl::PointCloud<pcl::Normal>);
  for (std::size_t i = 0; i < surface.size; ++i) {
    const bool has = surface.has_normal(i);
    cloud->push_back(
        {has ? surface.nx[i] : kNan, has ? surface.ny[i] : kNan, has ? surface.nz[i] : kNan});
  }
  return cloud;
}

OwnedSurface recorded_surface(const char* name) {
  const std::filesystem::path file = recorded_data(name);
  if (file.empty()) return {1, 0};
  return surface_of(read_cloud(file));
}

Limits limits_for(const Surface& surface) {
  Limits limits = small_limits();
  limits.max_points = surface.size + 1;
  limits.max_model_points = surface.size + 1;
  limits.max_input_points = surface.size + 1;
  limits.max_width = std::max(1, surface.grid.width);
  limits.max_height = std::max(1, surface.grid.height);
  limits.max_keypoints = surface.size + 1;
  return limits;
}

}  // namespace grapnel::test
