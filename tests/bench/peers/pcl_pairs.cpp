#include <pcl/features/fpfh.h>
#include <pcl/features/normal_3d.h>
#include <pcl/filters/voxel_grid.h>
#include <pcl/registration/correspondence_estimation.h>
#include <pcl/registration/correspondence_rejection_sample_consensus.h>
#include <pcl/registration/icp.h>
#include <pcl/registration/sample_consensus_prerejective.h>

#include "tests/bench/peers/pcl_clouds.h"
#include "tests/bench/peers/peers.h"

namespace grapnel::bench::peers {
namespace {

using Oriented = pcl::PointCloud<pcl::PointNormal>;
using Features = pcl::PointCloud<pcl::FPFHSignature33>;

/// A view thinned, with normals toward its viewpoint, and its features.
struct Described {
  Oriented::Ptr cloud{new Oriented};
  Features::Ptr features{new Features};
};

Described describe(const Surface& surface, double voxel_m) {
  Described view;
  Oriented::Ptr whole(new Oriented);
  for (std::size_t i = 0; i < surface.size; ++i) {
    pcl::PointNormal point;
    point.getVector3fMap() = surface.point(i);
    whole->push_back(point);
  }
  pcl::VoxelGrid<pcl::PointNormal> grid;
  grid.setInputCloud(whole);
  const auto leaf = static_cast<float>(voxel_m);
  grid.setLeafSize(leaf, leaf, leaf);
  grid.filter(*view.cloud);
  pcl::NormalEstimation<pcl::PointNormal, pcl::PointNormal> normals;
  normals.setInputCloud(view.cloud);
  normals.setRadiusSearch(2.0 * voxel_m);
  normals.setViewPoint(surface.viewpoint.x(), surface.viewpoint.y(), surface.viewpoint.z());
  normals.compute(*view.cloud);
  pcl::FPFHEstimation<pcl::PointNormal, pcl::PointNormal, pcl::FPFHSignature33> fpfh;
  fpfh.setInputCloud(view.cloud);
  fpfh.setInputNormals(view.cloud);
  fpfh.setRadiusSearch(5.0 * voxel_m);
  fpfh.compute(*view.features);
  return view;
}

Eigen::Matrix4f pose_by_rejector(const Described& source, const Described& target,
                                 double distance_m) {
  pcl::registration::CorrespondenceEstimation<pcl::FPFHSignature33, pcl::FPFHSignature33> pairing;
  pairing.setInputSource(source.features);
  pairing.setInputTarget(target.features);
  const pcl::CorrespondencesPtr pairs(new pcl::Correspondences);
  pairing.determineReciprocalCorrespondences(*pairs);
  pcl::registration::CorrespondenceRejectorSampleConsensus<pcl::PointNormal> rejector;
  rejector.setInputSource(source.cloud);
  rejector.setInputTarget(target.cloud);
  rejector.setInlierThreshold(distance_m);
  rejector.setMaximumIterations(10000);
  rejector.setInputCorrespondences(pairs);
  pcl::Correspondences kept;
  rejector.getCorrespondences(kept);
  return rejector.getBestTransformation();
}

Eigen::Matrix4f pose_by_prerejection(const Described& source, const Described& target,
                                     double distance_m) {
  pcl::SampleConsensusPrerejective<pcl::PointNormal, pcl::PointNormal, pcl::FPFHSignature33> align;
  align.setInputSource(source.cloud);
  align.setSourceFeatures(source.features);
  align.setInputTarget(target.cloud);
  align.setTargetFeatures(target.features);
  // Those of PCL's tutorial "Robust pose estimation of rigid objects".
  align.setMaximumIterations(50000);
  align.setNumberOfSamples(3);
  align.setCorrespondenceRandomness(5);
  align.setSimilarityThreshold(0.9F);
  align.setMaxCorrespondenceDistance(distance_m);
  align.setInlierFraction(0.25F);
  Oriented out;
  align.align(out);
  return align.getFinalTransformation();
}

}  // namespace

std::optional<Pose> register_pair(const Surface& source, const Surface& target, double voxel_m,
                                  FirstPose first) {
  const Described from = describe(source, voxel_m);
  const Described to = describe(target, voxel_m);
  const Eigen::Matrix4f coarse = first == FirstPose::Rejector
                                     ? pose_by_rejector(from, to, 1.5 * voxel_m)
                                     : pose_by_prerejection(from, to, 1.5 * voxel_m);
  pcl::IterativeClosestPointWithNormals<pcl::PointNormal, pcl::PointNormal> icp;
  icp.setInputSource(from.cloud);
  icp.setInputTarget(to.cloud);
  icp.setMaxCorrespondenceDistance(voxel_m);
  icp.setMaximumIterations(30);
  Oriented out;
  icp.align(out, coarse);
  return Pose(Mat4d(icp.getFinalTransformation().cast<double>()));
}

}  // namespace grapnel::bench::peers
