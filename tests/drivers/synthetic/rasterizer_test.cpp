#include "drivers/synthetic/rasterizer.h"

#include <gtest/gtest.h>

#include <cmath>

#include "base/math.h"
#include "base/rng.h"
#include "drivers/synthetic/shapes.h"

namespace grapnel {
namespace {

const Intrinsics kCamera{160, 120, 140.0, 150.0, 79.5, 59.5};

Pose at(const Vec3d& place_m, const Vec3d& turn_rad = Vec3d::Zero()) {
  Pose pose = Pose::Identity();
  pose.linear() = rotation_from_vector(turn_rad);
  pose.translation() = place_m;
  return pose;
}

/// Depth of the nearest hit of a pixel's ray, by brute force (Möller and Trumbore 1997); 0: none.
double cast_m(const Mesh& mesh, const Pose& camera_from_model, int u, int v) {
  const Vec3d ray((u - kCamera.cx) / kCamera.fx, (v - kCamera.cy) / kCamera.fy, 1.0);
  double nearest_m = 0.0;
  for (const Mesh::Triangle& corner : mesh.triangles) {
    const Vec3d a = camera_from_model * mesh.vertices[corner[0]];
    const Vec3d ab = camera_from_model * mesh.vertices[corner[1]] - a;
    const Vec3d ac = camera_from_model * mesh.vertices[corner[2]] - a;
    const Vec3d p = ray.cross(ac);
    const double determinant = ab.dot(p);
    if (std::fabs(determinant) < 1e-15) continue;
    const double s = -a.dot(p) / determinant;
    const Vec3d q = (-a).cross(ab);
    const double t = ray.dot(q) / determinant;
    if (s < 0.0 || t < 0.0 || s + t > 1.0) continue;
    const double z_m = ac.dot(q) / determinant;
    if (z_m > 0.0 && (nearest_m == 0.0 || z_m < nearest_m)) nearest_m = z_m;
  }
  return nearest_m;
}

TEST(Rasterizer, MeasuresTheTopOfABoxAtItsExactDepth) {
  Rasterizer raster(kCamera);
  raster.draw(make_box({0.4, 0.3, 0.2}), at({0.0, 0.0, 1.1}), 0);
  EXPECT_FLOAT_EQ(raster.inverse_depth().at(80, 60), 1.0f);
  EXPECT_EQ(raster.inverse_depth().at(2, 2), 0.0f);
  EXPECT_EQ(raster.face().at(2, 2), Rasterizer::kNoFace);
}

TEST(Rasterizer, CoversAsManyPixelsAsTheProjectedArea) {
  Rasterizer raster(kCamera);
  const std::size_t covered = raster.draw(make_box({0.4, 0.3, 0.2}), at({0.0, 0.0, 1.1}), 0).pixels;
  // The face at 1 m is 0.4·140 × 0.3·150 = 56 × 45 px; an edge may add or lose half a pixel.
  EXPECT_NEAR(static_cast<double>(covered), 56.0 * 45.0, 0.5 * (56.0 + 45.0) * 2.0);
}

TEST(Rasterizer, AgreesWithBruteForceRayCasting) {
  Rng rng(17);
  const Mesh shapes[] = {make_carton({0.38, 0.28, 0.22}), make_barrel({0.28, 0.28, 0.34})};
  for (const Mesh& mesh : shapes) {
    const Pose pose = at({rng.uniform(-0.1, 0.1), rng.uniform(-0.1, 0.1), 0.9},
                         {rng.uniform(-3.0, 3.0), rng.uniform(-3.0, 3.0), rng.uniform(-3.0, 3.0)});
    Rasterizer raster(kCamera);
    raster.draw(mesh, pose, 0);
    int disagreements = 0;
    for (int v = 0; v < kCamera.height; v += 3) {
      for (int u = 0; u < kCamera.width; u += 3) {
        const double expected_m = cast_m(mesh, pose, u, v);
        const auto inverse = static_cast<double>(raster.inverse_depth().at(u, v));
        if ((expected_m == 0.0) != (inverse == 0.0)) {
          ++disagreements;
        } else if (expected_m > 0.0) {
          EXPECT_NEAR(inverse * expected_m, 1.0, 1e-5) << u << " " << v;
        }
      }
    }
    // A ray through an edge may fall on either side by rounding.
    EXPECT_LE(disagreements, 1);
  }
}

TEST(Rasterizer, LeavesNoCrackBetweenTriangles) {
  Rasterizer raster(kCamera);
  raster.draw(make_sack({0.5, 0.34, 0.16}, 3), at({0.0, 0.0, 0.8}, {0.0, 0.0, 0.3}), 0);
  for (int v = 40; v < 80; ++v) {
    for (int u = 60; u < 100; ++u) EXPECT_GT(raster.inverse_depth().at(u, v), 0.0f);
  }
}

TEST(Rasterizer, CountsHiddenPixelsAsCovered) {
  Rasterizer raster(kCamera);
  const Mesh box = make_box({0.2, 0.2, 0.1});
  const std::size_t alone = raster.draw(box, at({0.0, 0.0, 1.0}), 0).pixels;
  raster.draw(make_box({0.4, 0.4, 0.1}), at({0.0, 0.0, 0.6}), 100);
  const std::size_t hidden = raster.draw(box, at({0.0, 0.0, 1.0}), 200).pixels;
  EXPECT_EQ(alone, hidden);
  EXPECT_GE(raster.face().at(80, 60), 100);
  EXPECT_LT(raster.face().at(80, 60), 200);
}

TEST(Rasterizer, DoesNotDrawWhatLiesBehindTheCamera) {
  Rasterizer raster(kCamera);
  EXPECT_EQ(raster.draw(make_box({0.2, 0.2, 0.1}), at({0.0, 0.0, -1.0}), 0).pixels, 0u);
}

TEST(Rasterizer, TellsWhetherAnOutlineLeavesTheImage) {
  Rasterizer raster(kCamera);
  const Mesh box = make_box({0.2, 0.2, 0.1});
  EXPECT_TRUE(raster.draw(box, at({0.0, 0.0, 1.0}), 0).inside);
  EXPECT_FALSE(raster.draw(box, at({0.5, 0.0, 1.0}), 0).inside);
}

}  // namespace
}  // namespace grapnel
