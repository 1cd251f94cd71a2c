#include <pcl/features/principal_curvatures.h>
#include <pcl/features/range_image_border_extractor.h>
#include <pcl/keypoints/harris_3d.h>
#include <pcl/keypoints/iss_3d.h>
#include <pcl/keypoints/narf_keypoint.h>
#include <pcl/keypoints/sift_keypoint.h>
#include <pcl/range_image/range_image_planar.h>

#include "tests/bench/peers/pcl_clouds.h"
#include "tests/bench/peers/peers.h"

namespace grapnel::bench::peers {

Work narf(const Surface& surface, double support_m) {
  const Surface::Grid& grid = surface.grid;
  auto image = std::make_shared<pcl::RangeImagePlanar>();
  std::vector<float> depth(grid.point_of.size(), 0.0F);
  for (std::size_t i = 0; i < surface.size; ++i) {
    depth[static_cast<std::size_t>(grid.pixel_of[i])] = surface.z[i];
  }
  image->setDepthImage(
      depth.data(), grid.width, grid.height, static_cast<float>(grid.intrinsics.cx),
      static_cast<float>(grid.intrinsics.cy), static_cast<float>(grid.intrinsics.fx),
      static_cast<float>(grid.intrinsics.fy));
  return [image, support_m] {
    pcl::RangeImageBorderExtractor extractor;
    pcl::NarfKeypoint detector(&extractor);
    detector.setRangeImage(image.get());
    detector.getParameters().support_size = static_cast<float>(support_m);
    pcl::PointCloud<int> out;
    detector.compute(out);
  };
}

Work iss(const Surface& surface, double salient_radius_m, double non_max_radius_m) {
  return [cloud = test::pcl_points(surface), salient_radius_m, non_max_radius_m] {
    pcl::ISSKeypoint3D<pcl::PointXYZ, pcl::PointXYZ> detector;
    detector.setInputCloud(cloud);
    detector.setSearchMethod(new_tree());
    detector.setSalientRadius(salient_radius_m);
    detector.setNonMaxRadius(non_max_radius_m);
    detector.setThreshold21(0.975);
    detector.setThreshold32(0.975);
    detector.setMinNeighbors(5);
    detector.setNumberOfThreads(1);
    Points out;
    detector.compute(out);
  };
}

Work harris(const Surface& surface, double radius_m) {
  return [cloud = test::pcl_points_with_intensity(surface), normals = test::pcl_normals(surface),
          radius = static_cast<float>(radius_m)] {
    pcl::HarrisKeypoint3D<pcl::PointXYZI, pcl::PointXYZI> detector;
    detector.setInputCloud(cloud);
    detector.setNormals(normals);
    detector.setRadius(radius);
    detector.setNonMaxSupression(true);
    detector.setThreshold(1e-4F);
    detector.setNumberOfThreads(1);
    pcl::PointCloud<pcl::PointXYZI> out;
    detector.compute(out);
  };
}

Work sift(const Surface& surface, double min_scale_m, int octaves, int scales,
          double min_contrast) {
  return [cloud = test::pcl_points_with_intensity(surface), min_scale_m, octaves, scales,
          min_contrast] {
    pcl::SIFTKeypoint<pcl::PointXYZI, pcl::PointWithScale> detector;
    detector.setInputCloud(cloud);
    detector.setScales(static_cast<float>(min_scale_m), octaves, scales);
    detector.setMinimumContrast(static_cast<float>(min_contrast));
    pcl::PointCloud<pcl::PointWithScale> out;
    detector.compute(out);
  };
}

Work curvatures(const Surface& surface, double radius_m) {
  return [cloud = test::pcl_points(surface), normals = test::pcl_normals(surface), radius_m] {
    pcl::PrincipalCurvaturesEstimation<pcl::PointXYZ, pcl::Normal, pcl::PrincipalCurvatures> it;
    it.setInputCloud(cloud);
    it.setInputNormals(normals);
    it.setSearchMethod(new_tree());
    it.setRadiusSearch(radius_m);
    pcl::PointCloud<pcl::PrincipalCurvatures> out;
    it.compute(out);
  };
}

}  // namespace grapnel::bench::peers
