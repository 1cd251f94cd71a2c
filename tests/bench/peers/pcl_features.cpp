#include <pcl/features/fpfh.h>
#include <pcl/features/pfh.h>
#include <pcl/features/spin_image.h>
#include <pcl/kdtree/kdtree_flann.h>
#include <pcl/registration/correspondence_rejection_sample_consensus.h>
#include <pcl/registration/icp.h>

#include <algorithm>

#include "tests/bench/peers/pcl_clouds.h"
#include "tests/bench/peers/peers.h"

namespace grapnel::bench::peers {
namespace {

template <class Estimation, class Signature>
Work describe(const Surface& surface, double radius_m, std::size_t count) {
  const pcl::IndicesPtr indices(new pcl::Indices);
  for (std::size_t i = 0; i < count; ++i) {
    indices->push_back(static_cast<int>(i * surface.size / count));
  }
  return
      [cloud = test::pcl_points(surface), normals = test::pcl_normals(surface), indices, radius_m] {
        Estimation estimation;
        estimation.setInputCloud(cloud);
        estimation.setInputNormals(normals);
        estimation.setIndices(indices);
        estimation.setSearchMethod(new_tree());
        estimation.setRadiusSearch(radius_m);
        pcl::PointCloud<Signature> out;
        estimation.compute(out);
      };
}

pcl::PointCloud<pcl::FPFHSignature33>::Ptr rows_of(const float* values, std::size_t rows,
                                                   std::size_t stride) {
  pcl::PointCloud<pcl::FPFHSignature33>::Ptr cloud(new pcl::PointCloud<pcl::FPFHSignature33>);
  for (std::size_t i = 0; i < rows; ++i) {
    pcl::FPFHSignature33 row;
    std::copy_n(values + i * stride, 33, row.histogram);
    cloud->push_back(row);
  }
  return cloud;
}

pcl::PointCloud<pcl::PointNormal>::Ptr oriented(const Surface& surface) {
  pcl::PointCloud<pcl::PointNormal>::Ptr cloud(new pcl::PointCloud<pcl::PointNormal>);
  for (std::size_t i = 0; i < surface.size; ++i) {
    pcl::PointNormal point;
    point.getVector3fMap() = surface.point(i);
    point.getNormalVector3fMap() = surface.normal(i);
    cloud->push_back(point);
  }
  return cloud;
}

}  // namespace

Work fpfh(const Surface& surface, double radius_m, std::size_t count) {
  using S = pcl::FPFHSignature33;
  return describe<pcl::FPFHEstimation<pcl::PointXYZ, pcl::Normal, S>, S>(surface, radius_m, count);
}

Work pfh(const Surface& surface, double radius_m, std::size_t count) {
  using S = pcl::PFHSignature125;
  return describe<pcl::PFHEstimation<pcl::PointXYZ, pcl::Normal, S>, S>(surface, radius_m, count);
}

Work spin_images(const Surface& surface, double radius_m, std::size_t count) {
  using S = pcl::Histogram<153>;
  return describe<pcl::SpinImageEstimation<pcl::PointXYZ, pcl::Normal, S>, S>(surface, radius_m,
                                                                              count);
}

Work match_33(const float* source, const float* target, std::size_t rows, std::size_t stride) {
  const auto tree = std::make_shared<pcl::KdTreeFLANN<pcl::FPFHSignature33>>();
  tree->setInputCloud(rows_of(target, rows, stride));
  return [tree, queries = rows_of(source, rows, stride)] {
    pcl::Indices found(2);
    std::vector<float> squared(2);
    for (const pcl::FPFHSignature33& query : *queries) {
      tree->nearestKSearch(query, 2, found, squared);
    }
  };
}

Work ransac(const Surface& source, const Surface& target, const int* pair_of,
            double inlier_distance_m, int draws) {
  const pcl::CorrespondencesPtr pairs(new pcl::Correspondences);
  for (std::size_t i = 0; i < source.size; ++i) {
    pairs->emplace_back(static_cast<int>(i), pair_of[i], 0.0F);
  }
  return [from = test::pcl_points(source), to = test::pcl_points(target), pairs, inlier_distance_m,
          draws] {
    pcl::registration::CorrespondenceRejectorSampleConsensus<pcl::PointXYZ> rejector;
    rejector.setInputSource(from);
    rejector.setInputTarget(to);
    rejector.setInlierThreshold(inlier_distance_m);
    rejector.setMaximumIterations(draws);
    rejector.setInputCorrespondences(pairs);
    pcl::Correspondences kept;
    rejector.getCorrespondences(kept);
  };
}

Work icp_to_plane(const Surface& source, const Surface& target, double distance_m, int iterations,
                  const Pose& start) {
  return [from = oriented(source), to = oriented(target), distance_m, iterations,
          guess = Eigen::Matrix4f(start.matrix().cast<float>())] {
    pcl::IterativeClosestPointWithNormals<pcl::PointNormal, pcl::PointNormal> icp;
    icp.setInputSource(from);
    icp.setInputTarget(to);
    icp.setMaxCorrespondenceDistance(distance_m);
    icp.setMaximumIterations(iterations);
    // Never converged: every iteration is run.
    icp.setTransformationEpsilon(0.0);
    icp.setTransformationRotationEpsilon(2.0);
    icp.setEuclideanFitnessEpsilon(-1.0);
    icp.getConvergeCriteria()->setAbsoluteMSE(-1.0);
    icp.getConvergeCriteria()->setRelativeMSE(-1.0);
    pcl::PointCloud<pcl::PointNormal> out;
    icp.align(out, guess);
  };
}

}  // namespace grapnel::bench::peers
