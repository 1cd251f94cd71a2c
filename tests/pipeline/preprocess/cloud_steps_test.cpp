#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <vector>

#include "base/rng.h"
#include "pipeline/preprocess/compact.h"
#include "pipeline/preprocess/normals.h"
#include "pipeline/preprocess/voxel.h"
#include "tests/pipeline/support/surfaces.h"

namespace grapnel {
namespace {

struct Normals {
  PcaNormals normals;
  test::ArenaMemory memory;
  explicit Normals(const PcaNormalsParams& params = {})
      : normals(params),
        memory([&](Arena& arena) { normals.reserve(arena, test::small_limits()); }) {}
};

TEST(PcaNormals, PointOutwardOnASphereWithoutViewpoint) {
  test::OwnedSurface ball = test::sphere(1500, 0.2, false);
  Normals n;
  ASSERT_TRUE(n.normals.estimate(*ball).ok());
  for (std::size_t i = 0; i < ball->size; ++i) {
    // Discretisation of a neighbourhood of three spacings on this sphere.
    ASSERT_GT(ball->normal(i).dot(ball->point(i).normalized()), 0.995F) << i;
    ASSERT_NEAR(ball->normal(i).norm(), 1.0F, 1e-6F);
  }
}

TEST(PcaNormals, PointTowardTheViewpoint) {
  test::OwnedSurface grid = test::wavy_grid(60, 50, 1);
  Normals n;
  ASSERT_TRUE(n.normals.estimate(*grid).ok());
  for (std::size_t i = 0; i < grid->size; ++i) {
    if (grid->has_normal(i)) {
      ASSERT_LE(grid->normal(i).dot(grid->point(i)), 0.0F);
    }
  }
}

TEST(PcaNormals, AreThoseOfAPlaneAndItsCurvatureIsZero) {
  test::OwnedSurface plane(400, 0);
  const Vec3d normal = Vec3d(0.3, -0.2, -0.9).normalized();
  const Vec3d u = normal.unitOrthogonal();
  const Vec3d v = normal.cross(u);
  Rng rng(2);
  for (std::size_t i = 0; i < 400; ++i) {
    const Vec3d p = Vec3d(0.1, 0.2, 1.0) + rng.uniform(0.0, 0.2) * u + rng.uniform(0.0, 0.2) * v;
    plane->x[i] = static_cast<float>(p.x());
    plane->y[i] = static_cast<float>(p.y());
    plane->z[i] = static_cast<float>(p.z());
  }
  plane->size = 400;
  plane->has_viewpoint = true;
  plane->spacing_m = 0.01;
  Normals n;
  ASSERT_TRUE(n.normals.estimate(*plane).ok());
  for (std::size_t i = 0; i < plane->size; ++i) {
    if (!plane->has_normal(i)) continue;
    // Float coordinates near 1 m are right to 6e-8 m, over neighbourhoods of 3 cm, and float sums
    // to 1e-6.
    ASSERT_LT((plane->normal(i).cast<double>() - normal).norm(), 1e-4);
    ASSERT_LT(n.normals.curvature()[i], 1e-6F);
  }
}

TEST(PcaNormals, OfACloudAreThoseOfItsSpheresInDouble) {
  test::OwnedSurface ball = test::bumpy_ball(1500, 0.2);
  Normals n;
  ASSERT_TRUE(n.normals.estimate(*ball).ok());
  const double radius_m = 3.0 * ball->spacing_m;
  for (std::size_t i = 0; i < ball->size; ++i) {
    Mat3d products = Mat3d::Zero();
    Vec3d sum = Vec3d::Zero();
    double count = 0.0;
    for (std::size_t j = 0; j < ball->size; ++j) {
      const Vec3d d = (ball->point(j) - ball->point(i)).cast<double>();
      // Beside the rim, where rounding decides.
      ASSERT_GT(std::fabs(d.norm() - radius_m), 1e-9);
      if (d.norm() > radius_m) continue;
      products += d * d.transpose();
      sum += d;
      count += 1.0;
    }
    const Mat3d covariance = products / count - (sum / count) * (sum / count).transpose();
    const Eigen::SelfAdjointEigenSolver<Mat3d> solver(covariance);
    // Radians: what single precision's 1e-7 of the matrix become at the gap of a flat sphere.
    const Vec3d axis = solver.eigenvectors().col(0);
    ASSERT_LT(ball->normal(i).cast<double>().cross(axis).norm(), 1e-5);
    ASSERT_NEAR(static_cast<double>(n.normals.curvature()[i]),
                solver.eigenvalues()[0] / covariance.trace(), 1e-6);
  }
}

TEST(PcaNormals, AreAbsentWherePointsAreFewOrInALine) {
  test::OwnedSurface line(50, 0);
  for (std::size_t i = 0; i < 50; ++i) line->x[i] = 0.01F * static_cast<float>(i);
  line->size = 50;
  line->spacing_m = 0.01;
  Normals n;
  ASSERT_TRUE(n.normals.estimate(*line).ok());
  for (std::size_t i = 0; i < 50; ++i) EXPECT_FALSE(line->has_normal(i));
  test::OwnedSurface few = test::random_cloud(4, 0.001, 3);
  few->spacing_m = 0.01;
  ASSERT_TRUE(n.normals.estimate(*few).ok());
  for (std::size_t i = 0; i < 4; ++i) EXPECT_FALSE(few->has_normal(i));
}

TEST(PcaNormals, RefuseAnEmptySurfaceAndOneWithoutSpacing) {
  Normals n;
  test::OwnedSurface empty(10, 0);
  empty->spacing_m = 0.01;
  EXPECT_EQ(n.normals.estimate(*empty).error(), (Error{Code::TooFewPoints, Stage::Normals, 0}));
  test::OwnedSurface unscaled = test::random_cloud(10, 1.0, 4);
  EXPECT_EQ(n.normals.estimate(*unscaled).error().code, Code::BadParameter);
}

TEST(PcaNormals, TurnWithTheCloud) {
  test::OwnedSurface ball = test::bumpy_ball(1000, 0.2);
  test::OwnedSurface moved = test::bumpy_ball(1000, 0.2);
  Pose pose = Pose::Identity();
  pose.linear() = Eigen::AngleAxisd(1.1, Vec3d(0.3, 0.5, -0.8).normalized()).toRotationMatrix();
  pose.translation() = Vec3d(0.4, -0.3, 0.9);
  test::move(*moved, pose);
  Normals n;
  ASSERT_TRUE(n.normals.estimate(*ball).ok());
  ASSERT_TRUE(n.normals.estimate(*moved).ok());
  for (std::size_t i = 0; i < ball->size; ++i) {
    const Vec3d turned = pose.linear() * ball->normal(i).cast<double>();
    // A neighbour on the rim of the sphere may fall to either side by rounding.
    ASSERT_GT(turned.dot(moved->normal(i).cast<double>()), 0.999) << i;
  }
}

struct Voxels {
  VoxelGrid voxels;
  test::ArenaMemory memory;
  explicit Voxels(const VoxelParams& params = {})
      : voxels(params),
        memory([&](Arena& arena) { voxels.reserve(arena, test::small_limits()); }) {}
};

TEST(VoxelGrid, ReplacesACellByItsCentroidInCellOrder) {
  test::OwnedSurface cloud(6, 0);
  const float places[6][3] = {{0.95F, 0.1F, 0.1F}, {0.1F, 0.1F, 1.2F}, {0.1F, 0.1F, 0.1F},
                              {0.3F, 0.1F, 0.1F},  {0.2F, 1.7F, 0.1F}, {0.2F, 0.4F, 0.1F}};
  for (std::size_t i = 0; i < 6; ++i) {
    cloud->x[i] = places[i][0];
    cloud->y[i] = places[i][1];
    cloud->z[i] = places[i][2];
    cloud->nx[i] = i == 2 ? 1.0F : 0.0F;
    cloud->ny[i] = i == 3 ? 1.0F : 0.0F;
    cloud->intensity[i] = 0.1F * static_cast<float>(i);
  }
  cloud->size = 6;
  Voxels v;
  const Result<std::size_t> removed = v.voxels.apply(*cloud, 0.5, 0);
  ASSERT_TRUE(removed.ok());
  EXPECT_EQ(removed.value(), 2U);
  ASSERT_EQ(cloud->size, 4U);
  EXPECT_NEAR(cloud->x[0], 0.2, 1e-6);  // cell 0: points 2, 3 and 5
  EXPECT_NEAR(cloud->y[0], 0.2, 1e-6);
  EXPECT_NEAR(cloud->nx[0], std::sqrt(0.5), 1e-6);
  EXPECT_NEAR(cloud->ny[0], std::sqrt(0.5), 1e-6);
  EXPECT_NEAR(cloud->intensity[0], 1.0 / 3.0, 1e-6);
  EXPECT_FLOAT_EQ(cloud->x[1], 0.95F);  // next along x
  EXPECT_FLOAT_EQ(cloud->y[2], 1.7F);   // then y
  EXPECT_FLOAT_EQ(cloud->z[3], 1.2F);   // then z
  EXPECT_FALSE(cloud->has_normal(1));
}

TEST(VoxelGrid, LeavesAtMostTheWantedPointsAndNotFarFewer) {
  for (const std::size_t wanted : {50U, 300U, 1500U}) {
    test::OwnedSurface ball = test::bumpy_ball(5000, 0.3);
    Voxels v;
    ASSERT_TRUE(v.voxels.apply(*ball, 0.0, wanted).ok());
    EXPECT_LE(ball->size, wanted);
    EXPECT_GE(ball->size, wanted * 8 / 10);
    EXPECT_GT(ball->spacing_m, 0.0);
  }
}

TEST(VoxelGrid, LeavesASparseCloudAsItIsAndMeasuresItsSpacing) {
  test::OwnedSurface ball = test::sphere(400, 0.1, true);
  const double spacing = ball->spacing_m;
  ball->spacing_m = 0.0;
  Voxels v;
  const Result<std::size_t> removed = v.voxels.apply(*ball);
  ASSERT_TRUE(removed.ok());
  EXPECT_EQ(removed.value(), 0U);
  EXPECT_EQ(ball->size, 400U);
  // The nearest neighbour on a Fibonacci lattice is a little nearer than the square root of the
  // area of a point.
  EXPECT_NEAR(ball->spacing_m, spacing, 0.2 * spacing);
}

TEST(VoxelGrid, DropsTheGridAndKeepsTheViewpoint) {
  test::OwnedSurface grid = test::wavy_grid(60, 50, 5);
  Voxels v;
  ASSERT_TRUE(v.voxels.apply(*grid, 0.05, 0).ok());
  EXPECT_FALSE(grid->organised());
  EXPECT_TRUE(grid->has_viewpoint);
  EXPECT_NEAR(grid->spacing_m, 0.05, 0.01);
}

TEST(VoxelGrid, HandlesDegenerateClouds) {
  Voxels v;
  test::OwnedSurface empty(10, 0);
  EXPECT_EQ(v.voxels.apply(*empty).error().code, Code::TooFewPoints);
  test::OwnedSurface same(100, 0);
  same->size = 100;
  ASSERT_TRUE(v.voxels.apply(*same, 0.0, 10).ok());
  EXPECT_EQ(same->size, 1U);
  test::OwnedSurface many = test::random_cloud(20001, 1.0, 6);
  EXPECT_EQ(v.voxels.apply(*many).error().code, Code::CapacityExceeded);
  test::OwnedSurface wide = test::random_cloud(10, 1.0, 7);
  wide->x[0] = 1e6F;
  EXPECT_EQ(v.voxels.apply(*wide, 0.001, 0).error().code, Code::BadParameter);
}

TEST(KeepPoints, MovesPointsUpAndTheGridFollows) {
  test::OwnedSurface grid = test::wavy_grid(20, 15, 8);
  const std::size_t before = grid->size;
  std::vector<std::uint8_t> keep(before, 1);
  for (std::size_t i = 0; i < before; i += 3) keep[i] = 0;
  const float second = grid->x[1];
  const std::size_t removed = keep_points(*grid, keep);
  EXPECT_EQ(removed, (before + 2) / 3);
  EXPECT_EQ(grid->size, before - removed);
  EXPECT_EQ(grid->x[0], second);
  std::size_t seen = 0;
  for (std::size_t pixel = 0; pixel < 300; ++pixel) {
    const std::int32_t point = grid->grid.point_of[pixel];
    if (point < 0) continue;
    EXPECT_EQ(grid->grid.pixel_of[static_cast<std::size_t>(point)],
              static_cast<std::int32_t>(pixel));
    ++seen;
  }
  EXPECT_EQ(seen, grid->size);
}

}  // namespace
}  // namespace grapnel
