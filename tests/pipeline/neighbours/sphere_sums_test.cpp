#include "pipeline/neighbours/sphere_sums.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "base/rng.h"
#include "pipeline/kernels/target.h"
#include "tests/pipeline/support/surfaces.h"

namespace grapnel {
namespace {

constexpr std::size_t kPoints = 3000;

/// Three clusters far apart, a line between them, and a few copies of one point; with normals.
test::OwnedSurface scattered() {
  test::OwnedSurface owned = test::random_cloud(kPoints, 0.2, 7);
  Surface& s = *owned;
  Rng rng(11);
  for (std::size_t i = 0; i < s.size; ++i) {
    if (i % 5 == 0) s.x[i] += 3.0F;
    if (i % 7 == 0) s.y[i] -= 2.0F;
    if (i % 50 == 0) s.x[i] = 0.001F * static_cast<float>(i);
    if (i % 100 == 1) s.x[i] = s.y[i] = s.z[i] = 0.1F;
    const Vec3d n = Vec3d(rng.normal(), rng.normal(), rng.normal()).normalized();
    const bool without = i % 9 == 0;
    s.nx[i] = without ? 0.0F : static_cast<float>(n.x());
    s.ny[i] = without ? 0.0F : static_cast<float>(n.y());
    s.nz[i] = without ? 0.0F : static_cast<float>(n.z());
  }
  return owned;
}

struct Expected {
  double count = 0.0;
  Vec3d first = Vec3d::Zero();
  Mat3d products = Mat3d::Zero();
  void add(const Vec3d& d) {
    count += 1.0;
    first += d;
    products += d * d.transpose();
  }
};

void expect_near(const SphereSums& sums, std::size_t i, const Expected& expected, double unit) {
  constexpr std::array<std::array<int, 2>, 6> kEntries = {
      {{0, 0}, {0, 1}, {0, 2}, {1, 1}, {1, 2}, {2, 2}}};
  // Sums of up to some hundred terms in single precision.
  const double tolerance = 1e-5 * std::max(1.0, expected.count);
  ASSERT_EQ(static_cast<double>(sums.count()[i]), expected.count) << i;
  for (std::size_t k = 0; k < 3; ++k) {
    ASSERT_NEAR(static_cast<double>(sums.first(k)[i]), expected.first[static_cast<Eigen::Index>(k)],
                tolerance * unit);
  }
  for (std::size_t k = 0; k < 6; ++k) {
    ASSERT_NEAR(static_cast<double>(sums.product(k)[i]),
                expected.products(kEntries[k][0], kEntries[k][1]), tolerance * unit * unit);
  }
}

TEST(SphereSums, OfACloudAreThoseOfBruteForce) {
  test::OwnedSurface cloud = scattered();
  const Surface& s = *cloud;
  SphereSums sums;
  const test::ArenaMemory memory([&](Arena& arena) { sums.reserve(arena, test::small_limits()); });
  for (const double radius : {0.02, 0.05, 5.0}) {
    // A float's square decides, as in the sums.
    const float squared = static_cast<float>(radius) * static_cast<float>(radius);
    std::vector<Expected> points(s.size);
    std::vector<Expected> normals(s.size);
    for (std::size_t i = 0; i < s.size; i += 17) {
      for (std::size_t j = 0; j < s.size; ++j) {
        const Vec3f d = s.point(j) - s.point(i);
        if (!((d.x() * d.x() + d.y() * d.y()) + d.z() * d.z() <= squared)) continue;
        points[i].add(d.cast<double>());
        if (s.has_normal(j)) normals[i].add((s.normal(j) - s.normal(i)).cast<double>());
      }
    }
    ASSERT_TRUE(sums.build(s, radius).ok());
    sums.scatter(true);
    for (std::size_t i = 0; i < s.size; i += 17) expect_near(sums, i, points[i], radius);
    sums.normals(true);
    for (std::size_t i = 0; i < s.size; i += 17) expect_near(sums, i, normals[i], 2.0);
  }
}

TEST(SphereSums, OfACloudAreTheSameBitsOnEveryTarget) {
  test::OwnedSurface cloud = scattered();
  SphereSums sums;
  const test::ArenaMemory memory([&](Arena& arena) { sums.reserve(arena, test::small_limits()); });
  std::vector<float> first;
  for (const std::string& target : kernels::target_names()) {
    ASSERT_TRUE(kernels::force_target(target));
    ASSERT_TRUE(sums.build(*cloud, 0.05).ok());
    std::vector<float> all;
    for (const bool of_points : {true, false}) {
      if (of_points) {
        sums.scatter(true);
      } else {
        sums.normals(false);
      }
      for (std::size_t k = 0; k < 6; ++k) {
        all.insert(all.end(), sums.product(k).begin(), sums.product(k).end());
      }
    }
    if (first.empty()) first = all;
    EXPECT_EQ(all, first) << target;
  }
  ASSERT_TRUE(kernels::force_target(""));
}

}  // namespace
}  // namespace grapnel
