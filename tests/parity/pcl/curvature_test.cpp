// Principal curvatures against PCL's with the same normals.
#include <gtest/gtest.h>
#include <pcl/features/principal_curvatures.h>
#include <pcl/search/kdtree.h>

#include <cmath>

#include "pipeline/preprocess/normals.h"
#include "pipeline/preprocess/principal_curvature.h"
#include "tests/parity/pcl/clouds.h"
#include "tests/support/recorded_data.h"

namespace grapnel {
namespace {

class CurvatureAgainstPcl : public testing::TestWithParam<Engine> {
 protected:
  static void compare(Surface& surface, double normal_radius_m, double radius_m) {
    PcaNormalsParams normal_params;
    normal_params.radius_m = normal_radius_m;
    normal_params.min_neighbours = 3;
    PcaNormals normals(normal_params);
    CurvatureParams params;
    params.engine = GetParam();
    params.radius_m = radius_m;
    PrincipalCurvature ours(params);
    const test::ArenaMemory memory([&](Arena& arena) {
      normals.reserve(arena, test::limits_for(surface));
      ours.reserve(arena, test::limits_for(surface));
    });
    ASSERT_TRUE(normals.estimate(surface).ok());
    ASSERT_TRUE(ours.estimate(surface).ok());
    pcl::PrincipalCurvaturesEstimation<pcl::PointXYZ, pcl::Normal, pcl::PrincipalCurvatures> pcl;
    pcl.setInputCloud(test::pcl_points(surface));
    pcl.setInputNormals(test::pcl_normals(surface));
    pcl.setSearchMethod(
        pcl::search::KdTree<pcl::PointXYZ>::Ptr(new pcl::search::KdTree<pcl::PointXYZ>));
    pcl.setRadiusSearch(radius_m);
    pcl::PointCloud<pcl::PrincipalCurvatures> theirs;
    pcl.compute(theirs);
    std::size_t compared = 0;
    for (std::size_t i = 0; i < surface.size; ++i) {
      // Where a normal around is missing, PCL has no curvature at all; ours leaves it out.
      if (!std::isfinite(theirs[i].pc1) || !surface.has_normal(i)) continue;
      ++compared;
      // Sums in single precision of values up to 1.
      ASSERT_NEAR(ours.largest()[i], theirs[i].pc1, 5e-6) << i;
      ASSERT_NEAR(ours.smallest()[i], theirs[i].pc2, 5e-6) << i;
      if (theirs[i].pc1 - theirs[i].pc2 < 1e-2F) continue;
      double cosine = 0.0;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        cosine += static_cast<double>(ours.direction(axis)[i]) *
                  static_cast<double>(theirs[i].principal_curvature[axis]);
      }
      ASSERT_GT(std::fabs(cosine), 1.0 - 1e-5) << i;
    }
    EXPECT_GT(compared * 2, surface.size);
  }
};
INSTANTIATE_TEST_SUITE_P(BothEngines, CurvatureAgainstPcl,
                         testing::Values(Engine::Fast, Engine::Reference));

TEST_P(CurvatureAgainstPcl, AgreesOnABumpyBall) {
  test::OwnedSurface ball = test::bumpy_ball(3000, 0.2);
  compare(*ball, 3.0 * ball->spacing_m, 4.0 * ball->spacing_m);
}

TEST_P(CurvatureAgainstPcl, AgreesOnACamerasGrid) {
  test::OwnedSurface grid = test::wavy_grid(80, 60, 5);
  // Not a multiple of the pitch: no neighbour lies on the sphere.
  compare(*grid, 4.3 * grid->spacing_m, 4.7 * grid->spacing_m);
}

TEST_P(CurvatureAgainstPcl, AgreesOnTheBunny) {
  test::OwnedSurface bunny = test::recorded_surface("pcl_test/bun0.pcd");
  if (bunny->size == 0) GTEST_SKIP() << test::kNoRecordedData;
  compare(*bunny, 0.02, 10.0);
}

}  // namespace
}  // namespace grapnel
