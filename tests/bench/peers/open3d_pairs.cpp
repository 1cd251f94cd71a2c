#include <open3d/geometry/KDTreeSearchParam.h>
#include <open3d/pipelines/registration/CorrespondenceChecker.h>
#include <open3d/pipelines/registration/Feature.h>
#include <open3d/pipelines/registration/Registration.h>
#include <open3d/utility/Random.h>

#include "tests/bench/peers/open3d.h"
#include "tests/bench/peers/open3d_clouds.h"

namespace grapnel::bench::peers::o3d {
namespace {

namespace registration = open3d::pipelines::registration;
using open3d::geometry::KDTreeSearchParamHybrid;

/// A view thinned, with normals toward its viewpoint, and its features.
struct Described {
  std::shared_ptr<Cloud> cloud;
  std::shared_ptr<registration::Feature> features;
};

Described describe(const Surface& surface, double voxel_m) {
  Described view;
  view.cloud = cloud_of(surface)->VoxelDownSample(voxel_m);
  view.cloud->EstimateNormals(KDTreeSearchParamHybrid(2.0 * voxel_m, 30));
  view.cloud->OrientNormalsTowardsCameraLocation(surface.viewpoint.cast<double>());
  view.features =
      registration::ComputeFPFHFeature(*view.cloud, KDTreeSearchParamHybrid(5.0 * voxel_m, 100));
  return view;
}

Mat4d coarse_pose(const Described& source, const Described& target, double distance_m) {
  const registration::CorrespondenceCheckerBasedOnEdgeLength edges(0.9);
  const registration::CorrespondenceCheckerBasedOnDistance near(distance_m);
  constexpr bool kMutual = true;
  constexpr int kDrawn = 3;
  return registration::RegistrationRANSACBasedOnFeatureMatching(
             *source.cloud, *target.cloud, *source.features, *target.features, kMutual, distance_m,
             registration::TransformationEstimationPointToPoint(false), kDrawn, {edges, near},
             registration::RANSACConvergenceCriteria(100000, 0.999))
      .transformation_;
}

}  // namespace

std::optional<Pose> register_pair(const Surface& source, const Surface& target, double voxel_m) {
  open3d::utility::random::Seed(1);
  const Described from = describe(source, voxel_m);
  const Described to = describe(target, voxel_m);
  const Mat4d coarse = coarse_pose(from, to, 1.5 * voxel_m);
  const Mat4d fine =
      registration::RegistrationICP(*from.cloud, *to.cloud, voxel_m, coarse,
                                    registration::TransformationEstimationPointToPlane())
          .transformation_;
  return Pose(fine);
}

}  // namespace grapnel::bench::peers::o3d
