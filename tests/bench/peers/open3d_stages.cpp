#include <omp.h>
#include <open3d/Open3DConfig.h>
#include <open3d/geometry/KDTreeSearchParam.h>
#include <open3d/geometry/Keypoint.h>
#include <open3d/pipelines/registration/Feature.h>
#include <open3d/pipelines/registration/Registration.h>

#include <cstdlib>

#include "tests/bench/peers/open3d.h"
#include "tests/bench/peers/open3d_clouds.h"

namespace grapnel::bench::peers::o3d {
namespace {

namespace registration = open3d::pipelines::registration;
using open3d::geometry::KDTreeSearchParamHybrid;
using open3d::geometry::KDTreeSearchParamRadius;

/// Open3D heeds OpenMP's number of threads only where the environment names one.
void keep_to_one_thread() {
  setenv("OMP_NUM_THREADS", "1", 1);
  omp_set_num_threads(1);
}

}  // namespace

const char* name() { return "Open3D " OPEN3D_VERSION; }

std::shared_ptr<Cloud> cloud_of(const Surface& surface, bool with_normals) {
  keep_to_one_thread();
  auto cloud = std::make_shared<Cloud>();
  cloud->points_.reserve(surface.size);
  for (std::size_t i = 0; i < surface.size; ++i) {
    cloud->points_.push_back(surface.point(i).cast<double>());
    if (with_normals) cloud->normals_.push_back(surface.normal(i).cast<double>());
  }
  return cloud;
}

Work voxels(const Surface& surface, double leaf_m) {
  return [cloud = cloud_of(surface), leaf_m] { (void)cloud->VoxelDownSample(leaf_m); };
}

Work statistical_outliers(const Surface& surface, int k, double deviations) {
  return [cloud = cloud_of(surface), k, deviations] {
    // Its neighbours include the point itself.
    (void)cloud->RemoveStatisticalOutliers(static_cast<std::size_t>(k) + 1, deviations);
  };
}

Work normals(const Surface& surface, double radius_m, int most) {
  return [cloud = cloud_of(surface), radius_m, most] {
    cloud->EstimateNormals(KDTreeSearchParamHybrid(radius_m, most));
  };
}

Work iss(const Surface& surface, double salient_radius_m, double non_max_radius_m) {
  return [cloud = cloud_of(surface), salient_radius_m, non_max_radius_m] {
    (void)open3d::geometry::keypoint::ComputeISSKeypoints(*cloud, salient_radius_m,
                                                          non_max_radius_m);
  };
}

Work fpfh(const Surface& surface, double radius_m) {
  return [cloud = cloud_of(surface, true), radius_m] {
    (void)registration::ComputeFPFHFeature(*cloud, KDTreeSearchParamRadius(radius_m));
  };
}

Work icp_to_plane(const Surface& source, const Surface& target, double distance_m, int iterations,
                  const Pose& start) {
  return [from = cloud_of(source), to = cloud_of(target, true), distance_m, iterations,
          guess = Mat4d(start.matrix())] {
    // Never converged: every iteration is run.
    const registration::ICPConvergenceCriteria every(-1.0, -1.0, iterations);
    (void)registration::RegistrationICP(
        *from, *to, distance_m, guess, registration::TransformationEstimationPointToPlane(), every);
  };
}

}  // namespace grapnel::bench::peers::o3d
