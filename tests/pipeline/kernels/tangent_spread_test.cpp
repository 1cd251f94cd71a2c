#include "pipeline/kernels/tangent_spread.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "base/geometry.h"
#include "base/rng.h"
#include "pipeline/kernels/target.h"

namespace grapnel {
namespace {

constexpr std::size_t kCount = 41;
constexpr std::size_t kPadded = kCount + kernels::kEigenBlock;

class TangentKernel : public testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { ASSERT_TRUE(kernels::force_target(GetParam())); }
  void TearDown() override { ASSERT_TRUE(kernels::force_target("")); }
};

INSTANTIATE_TEST_SUITE_P(OnEveryTarget, TangentKernel, testing::ValuesIn(kernels::target_names()),
                         [](const auto& target) { return target.param; });

/// Sums of ten random vectors around each point; every tenth point has no normal, and the first
/// normals lie along the axes.
struct Sums {
  std::array<std::vector<float>, 10> plane;
  std::array<std::vector<float>, 3> normal;

  Sums() {
    Rng rng(7);
    for (std::vector<float>& values : plane) values.assign(kPadded, 0.0F);
    for (std::vector<float>& values : normal) values.assign(kCount, 0.0F);
    for (std::size_t i = 0; i < kCount; ++i) {
      Vec3d n(rng.normal(), rng.normal(), rng.normal());
      if (i < 6) n = (i < 3 ? 1.0 : -1.0) * Vec3d::Unit(static_cast<Eigen::Index>(i % 3));
      n = i % 10 == 9 ? Vec3d(Vec3d::Zero()) : Vec3d(n.normalized());
      for (std::size_t k = 0; k < 3; ++k) {
        normal[k][i] = static_cast<float>(n[static_cast<Eigen::Index>(k)]);
      }
      for (int sample = 0; sample < 10; ++sample) add(i, rng);
    }
  }
  void add(std::size_t i, Rng& rng) {
    const std::array<float, 3> p = {static_cast<float>(rng.normal()),
                                    static_cast<float>(2.0 * rng.normal()),
                                    static_cast<float>(0.5 * rng.normal())};
    plane[0][i] += 1.0F;
    std::size_t product = 4;
    for (std::size_t a = 0; a < 3; ++a) {
      plane[a + 1][i] += p[a];
      for (std::size_t b = a; b < 3; ++b) plane[product++][i] += p[a] * p[b];
    }
  }
  [[nodiscard]] kernels::TangentSums sums() const {
    const auto at = [&](std::size_t k) { return plane[k].data(); };
    return {at(0),
            {at(1), at(2), at(3)},
            {at(4), at(5), at(6), at(7), at(8), at(9)},
            {normal[0].data(), normal[1].data(), normal[2].data()}};
  }
  [[nodiscard]] Vec3d normal_at(std::size_t i) const {
    return Vec3f(normal[0][i], normal[1][i], normal[2][i]).cast<double>();
  }
  /// M C Mᵀ with M = I - n nᵀ.
  [[nodiscard]] Mat3d projected(std::size_t i) const {
    const auto sum = [&](std::size_t k) { return static_cast<double>(plane[k][i]); };
    const double count = sum(0);
    const Vec3d mean = Vec3d(sum(1), sum(2), sum(3)) / count;
    Mat3d products;
    products << sum(4), sum(5), sum(6), sum(5), sum(7), sum(8), sum(6), sum(8), sum(9);
    const Vec3d n = normal_at(i);
    const Mat3d m = Mat3d::Identity() - n * n.transpose();
    return m * (products / count - mean * mean.transpose()) * m;
  }
};

struct Spread {
  std::array<std::vector<float>, 5> plane;
  explicit Spread(const Sums& sums) {
    for (std::vector<float>& values : plane) values.assign(kPadded, -1.0F);
    kernels::tangent_spread(sums.sums(), kCount, plane[0].data(), plane[1].data(),
                            {plane[2].data(), plane[3].data(), plane[4].data()});
    for (std::vector<float>& values : plane) values.resize(kCount);
  }
};

TEST_P(TangentKernel, GivesTheEigenvaluesOfTheProjectedCovariance) {
  const Sums sums;
  const Spread found(sums);
  for (std::size_t i = 0; i < kCount; ++i) {
    if (sums.normal_at(i).isZero()) {
      EXPECT_EQ(found.plane[0][i], 0.0F);
      EXPECT_EQ(found.plane[1][i], 0.0F);
      continue;
    }
    const Eigen::SelfAdjointEigenSolver<Mat3d> solver(sums.projected(i));
    // Single precision of what is stored, and a normal that is unit to single precision.
    EXPECT_NEAR(static_cast<double>(found.plane[0][i]), solver.eigenvalues()[2], 1e-5) << i;
    EXPECT_NEAR(static_cast<double>(found.plane[1][i]), solver.eigenvalues()[1], 1e-5) << i;
    const Vec3d along =
        Vec3f(found.plane[2][i], found.plane[3][i], found.plane[4][i]).cast<double>();
    EXPECT_NEAR(std::fabs(along.dot(solver.eigenvectors().col(2))), 1.0, 1e-5) << i;
  }
}

TEST(TangentSpread, IsTheSameBitsOnEveryTarget) {
  const Sums sums;
  const auto spread_on = [&](const std::string& target) {
    EXPECT_TRUE(kernels::force_target(target));
    const Spread found(sums);
    EXPECT_TRUE(kernels::force_target(""));
    return found.plane;
  };
  const std::vector<std::string> targets = kernels::target_names();
  for (const std::string& target : targets) {
    EXPECT_EQ(spread_on(target), spread_on(targets.front())) << target;
  }
}

}  // namespace
}  // namespace grapnel
