#include "pipeline/judge/overlap_information.h"

#include <gtest/gtest.h>

#include <cmath>

#include "base/rng.h"
#include "tests/pipeline/support/surfaces.h"

namespace grapnel {
namespace {

using test::ArenaMemory;
using test::OwnedSurface;

constexpr std::size_t kPoints = 3000;
constexpr double kReach_m = 0.02;

/// A surface whose normals are off by `noise_rad` about each of two axes.
class NoisyView {
 public:
  explicit NoisyView(std::size_t points)
      : surface_(points, 0), memory_([&](Arena& arena) { table_.reserve(arena, 400000); }) {
    (*surface_).size = 0;
  }

  void add(const Vec3f& point, const Vec3f& normal, double noise_rad, Rng& rng) {
    Surface& s = *surface_;
    const std::size_t i = s.size++;
    s.x[i] = point.x();
    s.y[i] = point.y();
    s.z[i] = point.z();
    const Vec3d across = normal.cast<double>().unitOrthogonal();
    const Vec3d other = normal.cast<double>().cross(across);
    const Vec3d noisy = normal.cast<double>() +
                        noise_rad * std::sqrt(3.0) *
                            (rng.uniform(-1.0, 1.0) * across + rng.uniform(-1.0, 1.0) * other);
    const Vec3f unit = noisy.normalized().cast<float>();
    s.nx[i] = unit.x();
    s.ny[i] = unit.y();
    s.nz[i] = unit.z();
  }

  OverlapView finish(double spacing_m) {
    (*surface_).spacing_m = spacing_m;
    table_.build(*surface_, kReach_m);
    return {&*surface_, &*surface_, &table_, {}};
  }
  Surface& surface() { return *surface_; }

 private:
  OwnedSurface surface_;
  ClosestPointTable table_;
  ArenaMemory memory_;
};

/// Half a cylinder of radius 0.15 and length 0.4 m about x.
void fill_with_cylinder(NoisyView& view, double noise_rad, Rng rng) {
  Rng places(7);
  for (std::size_t i = 0; i < kPoints; ++i) {
    const double angle = places.uniform(0.0, 3.14);
    const Vec3d normal(0.0, std::cos(angle), std::sin(angle));
    const Vec3d point = 0.15 * normal + Vec3d(places.uniform(-0.2, 0.2), 0.0, 0.0);
    view.add(point.cast<float>(), normal.cast<float>(), noise_rad, rng);
  }
}

/// Three faces of a cube of 0.3 m at the origin.
void fill_with_corner(NoisyView& view, double noise_rad, Rng rng) {
  Rng places(7);
  for (std::size_t i = 0; i < kPoints; ++i) {
    const auto face = static_cast<int>(i % 3);
    Vec3d point(places.uniform(0.0, 0.3), places.uniform(0.0, 0.3), places.uniform(0.0, 0.3));
    point[face] = 0.0;
    const Vec3d normal = -Vec3d::Unit(face);
    view.add(point.cast<float>(), normal.cast<float>(), noise_rad, rng);
  }
}

Mat6d information_of(void (*fill)(NoisyView&, double, Rng), double noise_rad) {
  NoisyView moved(kPoints);
  NoisyView fixed(kPoints);
  fill(moved, noise_rad, Rng(1));
  fill(fixed, noise_rad, Rng(2));
  return overlap_information(moved.surface(), fixed.finish(0.01), Pose::Identity(), kReach_m);
}

TEST(OverlapInformation, NoiseOfTheNormalsDoesNotFixACylindersTurn) {
  const Mat6d information = information_of(fill_with_cylinder, 0.05);
  // Noise alone would give n (0.15 m)² (0.05 rad)²: 0.17. A hundredth of that is left at most, by
  // the spread of a sum of 3000 terms (1/sqrt(3000) = 2 %) about nought, cut off below it.
  const double faked = kPoints * 0.15 * 0.15 * 0.05 * 0.05;
  EXPECT_LT(information(3, 3), 0.1 * faked);
  EXPECT_GT(information(4, 4), 5.0);  // tilting: about n/2 (0.4 m)²/12 = 20
}

TEST(OverlapInformation, OfACornerIsThatOfItsFaces) {
  const Mat6d information = information_of(fill_with_corner, 0.05);
  // Each face says n/3 about its own direction.
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(information(i, i), kPoints / 3.0, 0.03 * kPoints / 3.0);
  // Two faces with lever x² + ... : n/3 (y² + z² mean 2 · 0.03) over two faces of three.
  for (int i = 3; i < 6; ++i) EXPECT_NEAR(information(i, i), kPoints / 3.0 * 2.0 * 0.03, 3.0);
}

TEST(OverlapInformation, OfNothingIsNought) {
  NoisyView moved(kPoints);
  NoisyView fixed(kPoints);
  fill_with_corner(fixed, 0.0, Rng(1));
  EXPECT_EQ(overlap_information(moved.surface(), fixed.finish(0.01), Pose::Identity(), kReach_m),
            Mat6d::Zero());
}

}  // namespace
}  // namespace grapnel
