#include "drivers/synthetic/mesh.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/math.h"
#include "base/rng.h"
#include "drivers/synthetic/shapes.h"

namespace grapnel {
namespace {

constexpr PartKind kKinds[] = {PartKind::Box, PartKind::Carton, PartKind::Barrel, PartKind::Sack};

Mesh default_shape(PartKind kind) { return make_shape(kind, default_size_m(kind), kModelSackSeed); }

/// Is the point inside the closed mesh? By the winding number (van Oosterom and Strackee 1983).
bool contains(const Mesh& mesh, const Vec3d& point) {
  double solid_angle = 0.0;
  for (const Mesh::Triangle& corner : mesh.triangles) {
    const Vec3d a = mesh.vertices[corner[0]] - point;
    const Vec3d b = mesh.vertices[corner[1]] - point;
    const Vec3d c = mesh.vertices[corner[2]] - point;
    const double divisor = a.norm() * b.norm() * c.norm() + a.dot(b) * c.norm() +
                           b.dot(c) * a.norm() + c.dot(a) * b.norm();
    solid_angle += 2.0 * std::atan2(a.dot(b.cross(c)), divisor);
  }
  return std::fabs(solid_angle) > 2.0 * math::kPi;
}

TEST(Shapes, EnclosedVolumeOfABoxIsItsSidesProduct) {
  const Mesh box = make_box({0.4, 0.3, 0.2});
  EXPECT_NEAR(enclosed_volume_m3(box), 0.024, 1e-12);
  EXPECT_NEAR(surface_area_m2(box), 0.52, 1e-12);
}

TEST(Shapes, CartonIsTheBoxLessItsDeckPlusTheStepLessTheRecess) {
  const Vec3d size(0.38, 0.28, 0.22);
  const double body = size.x() * size.y() * (size.z() - kCartonStep_m);
  const double legs = 0.62 * 0.40 + 0.26 * (1.0 - 0.40);
  const double recess = 0.16 * 0.36;
  const double expected = body + size.x() * size.y() * kCartonStep_m * (legs - recess);
  EXPECT_NEAR(enclosed_volume_m3(make_carton(size)), expected, 1e-12);
}

TEST(Shapes, BarrelVolumeIsThatOfItsConesByPappus) {
  // A cylinder of the body's radius is a lower bound, one of the rims' radius an upper bound.
  const Mesh barrel = make_barrel({0.28, 0.28, 0.34});
  const double body = math::kPi * 0.132 * 0.132 * (0.34 - 0.03);
  const double hull = math::kPi * 0.14 * 0.14 * 0.34;
  EXPECT_GT(enclosed_volume_m3(barrel), body);
  EXPECT_LT(enclosed_volume_m3(barrel), hull);
}

TEST(Shapes, FillTheirSizeAroundTheOrigin) {
  for (const PartKind kind : kKinds) {
    const Bounds bounds = bounds_of(default_shape(kind));
    EXPECT_LT((bounds.size_m() - default_size_m(kind)).norm(), 1e-9) << static_cast<int>(kind);
    EXPECT_LT(bounds.centre_m().norm(), 1e-9) << static_cast<int>(kind);
  }
}

TEST(Shapes, AreClosedSoThatTheirAreaVectorsCancel) {
  for (const PartKind kind : kKinds) {
    const Mesh mesh = default_shape(kind);
    Vec3d sum = Vec3d::Zero();
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
      sum += triangle_area_m2(mesh, i) * triangle_normal(mesh, i);
    }
    EXPECT_LT(sum.norm(), 1e-12) << static_cast<int>(kind);
    EXPECT_GT(enclosed_volume_m3(mesh), 0.0) << static_cast<int>(kind);
  }
}

TEST(Shapes, NormalsLeadOutOfTheSolid) {
  for (const PartKind kind : kKinds) {
    const Mesh mesh = default_shape(kind);
    const SurfaceSamples samples = sample_surface(mesh, 0.06, 3);
    ASSERT_GT(samples.points_m.size(), 40u);
    for (std::size_t i = 0; i < samples.points_m.size(); ++i) {
      EXPECT_FALSE(contains(mesh, samples.points_m[i] + 1e-4 * samples.normals[i]));
      EXPECT_TRUE(contains(mesh, samples.points_m[i] - 1e-4 * samples.normals[i]));
    }
  }
}

/// Height of the surface above (x, y): the highest one, or minus the lowest one.
double height_m(const Mesh& mesh, double x, double y, bool from_below) {
  double best = -std::numeric_limits<double>::infinity();
  for (const Mesh::Triangle& corner : mesh.triangles) {
    const Vec3d& a = mesh.vertices[corner[0]];
    const Vec3d ab = mesh.vertices[corner[1]] - a;
    const Vec3d ac = mesh.vertices[corner[2]] - a;
    const double area = ab.x() * ac.y() - ab.y() * ac.x();
    if (area == 0.0) continue;
    const double s = ((x - a.x()) * ac.y() - (y - a.y()) * ac.x()) / area;
    const double t = (ab.x() * (y - a.y()) - ab.y() * (x - a.x())) / area;
    if (s < 0.0 || t < 0.0 || s + t > 1.0) continue;
    const double z = a.z() + s * ab.z() + t * ac.z();
    best = std::max(best, from_below ? -z : z);
  }
  return best;
}

/// Largest difference of height, seen from above, between a part and itself after a half turn.
double half_turn_difference_m(const Mesh& mesh, double sign_x, double sign_y, bool flip) {
  const Bounds bounds = bounds_of(mesh);
  double largest = 0.0;
  for (double x = 0.85 * bounds.low_m.x(); x < 0.85 * bounds.high_m.x(); x += 0.0213) {
    for (double y = 0.85 * bounds.low_m.y(); y < 0.85 * bounds.high_m.y(); y += 0.0197) {
      const double turned = height_m(mesh, sign_x * x, sign_y * y, flip);
      largest = std::max(largest, std::fabs(height_m(mesh, x, y, false) - turned));
    }
  }
  return largest;
}

TEST(Shapes, CartonAndSackDifferFromTheirHalfTurnsByMoreThanTheSensorsNoise) {
  // 15 mm is ten standard deviations of a Kinect at 1 m (Khoshelham and Elberink 2012).
  for (const PartKind kind : {PartKind::Carton, PartKind::Sack}) {
    const Mesh mesh = default_shape(kind);
    EXPECT_GT(half_turn_difference_m(mesh, -1.0, -1.0, false), 0.015) << "about z";
    EXPECT_GT(half_turn_difference_m(mesh, 1.0, -1.0, true), 0.015) << "about x";
    EXPECT_GT(half_turn_difference_m(mesh, -1.0, 1.0, true), 0.015) << "about y";
  }
}

TEST(Shapes, BoxEqualsItsHalfTurns) {
  const Mesh mesh = default_shape(PartKind::Box);
  EXPECT_NEAR(half_turn_difference_m(mesh, -1.0, -1.0, false), 0.0, 1e-12);
  EXPECT_NEAR(half_turn_difference_m(mesh, 1.0, -1.0, true), 0.0, 1e-12);
}

TEST(Shapes, BarrelIsRoundAboutItsAxis) {
  // Every ring of 96 corners has one height and one radius.
  const Mesh barrel = default_shape(PartKind::Barrel);
  ASSERT_EQ(barrel.vertices.size() % 96, 0u);
  for (std::size_t i = 0; i < barrel.vertices.size(); ++i) {
    const Vec3d& first = barrel.vertices[i / 96 * 96];
    EXPECT_EQ(barrel.vertices[i].z(), first.z());
    EXPECT_NEAR(barrel.vertices[i].head<2>().norm(), first.head<2>().norm(), 1e-12);
  }
}

TEST(Shapes, AnotherSeedMakesAnotherSack) {
  const Vec3d size = default_size_m(PartKind::Sack);
  const Mesh first = make_sack(size, 1);
  const Mesh again = make_sack(size, 1);
  const Mesh other = make_sack(size, 2);
  EXPECT_EQ(first.vertices, again.vertices);
  double largest_m = 0.0;
  for (std::size_t i = 0; i < first.vertices.size(); ++i) {
    largest_m = std::max(largest_m, (first.vertices[i] - other.vertices[i]).norm());
  }
  EXPECT_GT(largest_m, 0.01);
}

TEST(SampleSurface, KeepsThePointsApartAndLeavesNoHole) {
  const Mesh box = make_box({0.2, 0.15, 0.1});
  const double spacing_m = 0.01;
  const SurfaceSamples samples = sample_surface(box, spacing_m, 11);
  for (std::size_t i = 0; i < samples.points_m.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      ASSERT_GE((samples.points_m[i] - samples.points_m[k]).norm(), spacing_m);
    }
  }
  Rng rng(5);
  for (int trial = 0; trial < 500; ++trial) {
    const Vec3d on_top(rng.uniform(-0.1, 0.1), rng.uniform(-0.075, 0.075), 0.05);
    double nearest_m = 1.0;
    for (const Vec3d& point : samples.points_m) {
      nearest_m = std::min(nearest_m, (point - on_top).norm());
    }
    // A maximal dart throw leaves no gap of the spacing; a few per cent of slack as it is cut off.
    EXPECT_LT(nearest_m, 1.25 * spacing_m);
  }
}

TEST(SampleSurface, LiesOnTheFaceWhoseNormalItGives) {
  const SurfaceSamples samples = sample_surface(make_box({0.2, 0.15, 0.1}), 0.01, 11);
  const Vec3d half(0.1, 0.075, 0.05);
  for (std::size_t i = 0; i < samples.points_m.size(); ++i) {
    const Vec3d& normal = samples.normals[i];
    EXPECT_NEAR(normal.norm(), 1.0, 1e-12);
    EXPECT_NEAR(samples.points_m[i].dot(normal), half.dot(normal.cwiseAbs()), 1e-12);
  }
}

}  // namespace
}  // namespace grapnel
