// Sampling, cells with covariances, borders and normals by integral images beside the installed
// PCL.
#include <gtest/gtest.h>
#include <pcl/features/boundary.h>
#include <pcl/features/integral_image_normal.h>
#include <pcl/filters/covariance_sampling.h>
#include <pcl/filters/voxel_grid_covariance.h>
#include <pcl/search/kdtree.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "base/cloud_file.h"
#include "pipeline/preprocess/border_points.h"
#include "pipeline/preprocess/covariance_sampling.h"
#include "pipeline/preprocess/integral_normals.h"
#include "pipeline/preprocess/normals.h"
#include "pipeline/preprocess/voxel_covariance.h"
#include "tests/parity/pcl/clouds.h"
#include "tests/support/recorded_data.h"

namespace grapnel {
namespace {

template <class Stage>
struct Reserved {
  Stage stage;
  test::ArenaMemory memory;
  template <class Params>
  Reserved(const Params& params, const Surface& surface)
      : stage(params),
        memory([&](Arena& arena) { stage.reserve(arena, test::limits_for(surface)); }) {}
};

void estimate_normals(Surface& surface, double radius_m) {
  PcaNormalsParams params;
  params.radius_m = radius_m;
  Reserved<PcaNormals> normals(params, surface);
  ASSERT_TRUE(normals.stage.estimate(surface).ok());
}

pcl::PointCloud<pcl::PointNormal>::Ptr pcl_oriented(const Surface& surface) {
  pcl::PointCloud<pcl::PointNormal>::Ptr cloud(new pcl::PointCloud<pcl::PointNormal>);
  for (std::size_t i = 0; i < surface.size; ++i) {
    pcl::PointNormal point;
    point.getVector3fMap() = surface.point(i);
    point.getNormalVector3fMap() = surface.normal(i);
    cloud->push_back(point);
  }
  return cloud;
}

TEST(PclSampling, CovarianceSamplingLeavesTheSamePoints) {
  test::OwnedSurface ball = test::bumpy_ball(4000, 0.2);
  estimate_normals(*ball, 3.0 * ball->spacing_m);
  pcl::CovarianceSampling<pcl::PointNormal, pcl::PointNormal> theirs;
  const auto cloud = pcl_oriented(*ball);
  theirs.setInputCloud(cloud);
  theirs.setNormals(cloud);
  theirs.setNumberOfSamples(500);
  // Theirs are sums in single precision.
  EXPECT_NEAR(covariance_condition(*ball) / theirs.computeConditionNumber(), 1.0, 1e-4);
  pcl::Indices kept;
  theirs.filter(kept);
  std::vector<bool> theirs_keep(ball->size, false);
  for (const int index : kept) theirs_keep[static_cast<std::size_t>(index)] = true;
  test::OwnedSurface before = test::bumpy_ball(4000, 0.2);
  Reserved<CovarianceSampling> ours(CovarianceSamplingParams{500}, *ball);
  ASSERT_TRUE(ours.stage.apply(*ball).ok());
  ASSERT_EQ(ball->size, 500U);
  std::size_t common = 0;
  for (std::size_t i = 0, k = 0; i < before->size && k < ball->size; ++i) {
    if (before->point(i) != ball->point(k)) continue;
    ++k;
    common += theirs_keep[i] ? 1 : 0;
  }
  // A point that is as good as another to single precision may be taken for it.
  EXPECT_GE(common, 480U);
}

TEST(PclCells, CovariancesAreTheSame) {
  for (const char* const name : {"pcl_test/bun0.pcd", "pcl_test/bunny.pcd"}) {
    test::OwnedSurface surface = test::recorded_surface(name);
    if (surface->size == 0) GTEST_SKIP() << test::kNoRecordedData;
    pcl::VoxelGridCovariance<pcl::PointXYZ> theirs;
    theirs.setInputCloud(test::pcl_points(*surface));
    theirs.setLeafSize(0.02F, 0.02F, 0.02F);
    pcl::PointCloud<pcl::PointXYZ> means;
    theirs.filter(means, true);
    VoxelCovarianceParams params;
    Reserved<VoxelCovariance> ours(params, *surface);
    ASSERT_TRUE(ours.stage.apply(*surface).ok());
    ASSERT_EQ(surface->size, means.size());
    for (std::size_t i = 0; i < means.size(); ++i) {
      const auto* const leaf = theirs.getLeaf(means[i]);
      ASSERT_NE(leaf, nullptr);
      const Eigen::Matrix3d expected = leaf->getCov();
      const Symmetric3& found = ours.stage.covariances()[i];
      const double scale = expected.trace();
      // Theirs are the differences of large sums, in double.
      ASSERT_NEAR(found.xx / scale, expected(0, 0) / scale, 1e-9) << name << ' ' << i;
      ASSERT_NEAR(found.xy / scale, expected(0, 1) / scale, 1e-9) << name << ' ' << i;
      ASSERT_NEAR(found.xz / scale, expected(0, 2) / scale, 1e-9) << name << ' ' << i;
      ASSERT_NEAR(found.yy / scale, expected(1, 1) / scale, 1e-9) << name << ' ' << i;
      ASSERT_NEAR(found.yz / scale, expected(1, 2) / scale, 1e-9) << name << ' ' << i;
      ASSERT_NEAR(found.zz / scale, expected(2, 2) / scale, 1e-9) << name << ' ' << i;
    }
  }
}

TEST(PclBorders, FlagsAreTheSame) {
  test::OwnedSurface bunny = test::recorded_surface("pcl_test/bun0.pcd");
  if (bunny->size == 0) GTEST_SKIP() << test::kNoRecordedData;
  constexpr double kRadius_m = 0.0171;
  estimate_normals(*bunny, 0.02);
  pcl::BoundaryEstimation<pcl::PointXYZ, pcl::Normal, pcl::Boundary> theirs;
  theirs.setInputCloud(test::pcl_points(*bunny));
  theirs.setInputNormals(test::pcl_normals(*bunny));
  theirs.setSearchMethod(
      pcl::search::KdTree<pcl::PointXYZ>::Ptr(new pcl::search::KdTree<pcl::PointXYZ>));
  theirs.setRadiusSearch(kRadius_m);
  pcl::PointCloud<pcl::Boundary> expected;
  theirs.compute(expected);
  BorderPointsParams params;
  params.radius_m = kRadius_m;
  Reserved<BorderPoints> ours(params, *bunny);
  const auto found = ours.stage.find(*bunny);
  ASSERT_TRUE(found.ok());
  std::size_t borders = 0;
  for (std::size_t i = 0; i < bunny->size; ++i) {
    if (!bunny->has_normal(i)) continue;
    ASSERT_EQ(found.value()[i], expected[i].boundary_point) << i;
    borders += found.value()[i];
  }
  EXPECT_GT(borders, 20U);
  EXPECT_LT(borders, bunny->size / 2);
}

using By = IntegralNormalsParams::By;
using TheirNormals = pcl::IntegralImageNormalEstimation<pcl::PointXYZ, pcl::Normal>;

struct Way {
  By ours;
  TheirNormals::NormalEstimationMethod theirs;
  double median_deg;      ///< of the angle between both
  double nearly_all_deg;  ///< of 99 in 100
};

class PclIntegralNormals : public testing::TestWithParam<Way> {
 protected:
  static pcl::PointCloud<pcl::Normal> their_normals(const Surface& surface) {
    constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
    const auto width = static_cast<std::uint32_t>(surface.grid.width);
    const auto height = static_cast<std::uint32_t>(surface.grid.height);
    pcl::PointCloud<pcl::PointXYZ>::Ptr cloud(
        new pcl::PointCloud<pcl::PointXYZ>(width, height, {kNan, kNan, kNan}));
    cloud->is_dense = false;
    for (std::size_t i = 0; i < surface.size; ++i) {
      (*cloud)[static_cast<std::size_t>(surface.grid.pixel_of[i])] = {surface.x[i], surface.y[i],
                                                                      surface.z[i]};
    }
    TheirNormals theirs;
    theirs.setNormalEstimationMethod(GetParam().theirs);
    theirs.setMaxDepthChangeFactor(0.02F);
    theirs.setNormalSmoothingSize(10.0F);
    theirs.setInputCloud(cloud);
    pcl::PointCloud<pcl::Normal> normals;
    theirs.compute(normals);
    return normals;
  }
  static void compare(Surface& surface, std::size_t fewest) {
    const pcl::PointCloud<pcl::Normal> expected = their_normals(surface);
    IntegralNormalsParams params;
    params.by = GetParam().ours;
    Reserved<IntegralNormals> ours(params, surface);
    ASSERT_TRUE(ours.stage.estimate(surface).ok());
    std::vector<double> angles_deg;
    for (std::size_t i = 0; i < surface.size; ++i) {
      const pcl::Normal& n = expected[static_cast<std::size_t>(surface.grid.pixel_of[i])];
      // PCL leaves out the outermost ten pixels; ours has normals there too.
      if (!std::isfinite(n.normal_x)) continue;
      ASSERT_TRUE(surface.has_normal(i)) << i;
      const Vec3f theirs = n.getNormalVector3fMap();
      const double sine = static_cast<double>(surface.normal(i).cross(theirs).norm());
      angles_deg.push_back(std::asin(std::min(1.0, sine)) * 180.0 / 3.14159265358979);
    }
    ASSERT_GT(angles_deg.size(), fewest);
    std::sort(angles_deg.begin(), angles_deg.end());
    EXPECT_LT(angles_deg[angles_deg.size() / 2], GetParam().median_deg);
    EXPECT_LT(angles_deg[angles_deg.size() * 99 / 100], GetParam().nearly_all_deg);
  }
};

TEST_P(PclIntegralNormals, AreTheSameOnACamerasGridWithGaps) {
  test::OwnedSurface grid = test::wavy_grid(320, 240, 3);
  compare(*grid, 3000);
}

TEST_P(PclIntegralNormals, AreTheSameOnARecordedFrame) {
  const auto file = test::recorded_data("pcl_test/milk_cartoon_all_small_clorox.pcd");
  if (file.empty()) GTEST_SKIP() << test::kNoRecordedData;
  test::OwnedSurface frame =
      test::grid_surface_of(read_cloud(file), {640, 480, 525.0, 525.0, 319.5, 239.5});
  compare(*frame, 100000);
}

// PCL's covariance is the difference of sums about the origin in single precision.
INSTANTIATE_TEST_SUITE_P(
    EachWay, PclIntegralNormals,
    testing::Values(Way{By::CovarianceMatrix, TheirNormals::COVARIANCE_MATRIX, 0.5, 10.0},
                    Way{By::Average3dGradient, TheirNormals::AVERAGE_3D_GRADIENT, 1e-3, 0.01},
                    Way{By::Simple3dGradient, TheirNormals::SIMPLE_3D_GRADIENT, 1e-3, 0.01}),
    [](const auto& way) {
      switch (way.param.ours) {
        case By::CovarianceMatrix:
          return "CovarianceMatrix";
        case By::Average3dGradient:
          return "Average3dGradient";
        default:
          return "Simple3dGradient";
      }
    });

}  // namespace
}  // namespace grapnel
