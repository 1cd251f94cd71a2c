#include <pcl/features/integral_image_normal.h>
#include <pcl/filters/median_filter.h>
#include <pcl/filters/statistical_outlier_removal.h>
#include <pcl/filters/voxel_grid.h>
#include <pcl/pcl_config.h>

#include "tests/bench/peers/pcl_clouds.h"
#include "tests/bench/peers/peers.h"

namespace grapnel::bench::peers {

const char* name() { return "PCL " PCL_VERSION_PRETTY; }

Work grid_normals(const Surface& surface, GridNormals method) {
  return [cloud = organised_points(surface), method] {
    using Estimation = pcl::IntegralImageNormalEstimation<pcl::PointXYZ, pcl::Normal>;
    Estimation estimation;
    estimation.setNormalEstimationMethod(
        method == GridNormals::DepthChange ? Estimation::AVERAGE_DEPTH_CHANGE
        : method == GridNormals::Gradient  ? Estimation::AVERAGE_3D_GRADIENT
                                           : Estimation::COVARIANCE_MATRIX);
    // As in PCL's tutorial of organised normals.
    estimation.setMaxDepthChangeFactor(0.02F);
    estimation.setNormalSmoothingSize(10.0F);
    estimation.setInputCloud(cloud);
    Normals out;
    estimation.compute(out);
  };
}

Work median_5x5(const Surface& surface) {
  return [cloud = organised_points(surface)] {
    pcl::MedianFilter<pcl::PointXYZ> filter;
    filter.setInputCloud(cloud);
    filter.setWindowSize(5);
    Points out;
    filter.filter(out);
  };
}

Work statistical_outliers(const Surface& surface, int k, double deviations) {
  return [cloud = test::pcl_points(surface), k, deviations] {
    pcl::StatisticalOutlierRemoval<pcl::PointXYZ> filter;
    filter.setInputCloud(cloud);
    filter.setMeanK(k);
    filter.setStddevMulThresh(deviations);
    Points out;
    filter.filter(out);
  };
}

Work voxels(const Surface& surface, double leaf_m) {
  return [cloud = test::pcl_points(surface), leaf = static_cast<float>(leaf_m)] {
    pcl::VoxelGrid<pcl::PointXYZ> filter;
    filter.setInputCloud(cloud);
    filter.setLeafSize(leaf, leaf, leaf);
    Points out;
    filter.filter(out);
  };
}

}  // namespace grapnel::bench::peers
