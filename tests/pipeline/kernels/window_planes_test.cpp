#include "pipeline/kernels/window_planes.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <string>
#include <vector>

#include "base/geometry.h"
#include "base/rng.h"
#include "pipeline/kernels/target.h"

namespace grapnel {
namespace {

using kernels::kStrip;

constexpr int kReach = 3;
constexpr int kRows = 2 * kReach + 1;
constexpr std::ptrdiff_t kStride = static_cast<std::ptrdiff_t>(kStrip) + 2 * kReach + 8;

class WindowPlanes : public testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { ASSERT_TRUE(kernels::force_target(GetParam())); }
  void TearDown() override { ASSERT_TRUE(kernels::force_target("")); }
};

INSTANTIATE_TEST_SUITE_P(OnEveryTarget, WindowPlanes, testing::ValuesIn(kernels::target_names()),
                         [](const auto& target) { return target.param; });

/// Inverse depths of a tilted sheet with noise and holes, and a step in the last third.
std::vector<float> sheet() {
  std::vector<float> inverse(static_cast<std::size_t>(kStride) * kRows, 0.0F);
  Rng rng(3);
  for (int v = 0; v < kRows; ++v) {
    for (int u = 0; u < static_cast<int>(kStrip) + 2 * kReach; ++u) {
      if (rng.uniform() < 0.25) continue;
      const double step = u > 45 ? 0.4 : 0.0;
      inverse[static_cast<std::size_t>(v * kStride + u)] =
          static_cast<float>(1.0 + 0.002 * u - 0.003 * v + step + 0.001 * rng.normal());
    }
  }
  return inverse;
}

kernels::StripPlace place() {
  kernels::StripPlace place;
  place.first_u = -30.5F;
  place.v = 12.25F;
  place.fx = 140.0F;
  place.fy = 141.0F;
  place.max_span = 0.5F;
  place.max_off = 0.01F;
  return place;
}

struct Normals {
  std::array<float, kStrip> x{}, y{}, z{};
};

Normals fit(const std::vector<float>& inverse) {
  std::array<kernels::RowSums, kRows> sums;
  std::array<const kernels::RowSums*, kRows> rows;
  for (std::size_t k = 0; k < kRows; ++k) {
    kernels::sum_row(inverse.data() + static_cast<std::ptrdiff_t>(k) * kStride + kReach, kReach,
                     sums[k]);
    rows[k] = &sums[k];
  }
  Normals found;
  kernels::fit_window_planes(rows.data(), kReach, inverse.data() + kReach * kStride + kReach,
                             place(), found.x.data(), found.y.data(), found.z.data());
  return found;
}

/// The least-squares plane by its normal equations in double; zero where there is a step or no
/// reading.
Vec3d plainly(const std::vector<float>& inverse, int column) {
  const auto at = [&](int du, int dv) {
    return static_cast<double>(
        inverse[static_cast<std::size_t>((kReach + dv) * kStride + kReach + column + du)]);
  };
  Mat3d matrix = Mat3d::Zero();
  Vec3d right = Vec3d::Zero();
  double squares = 0.0;
  double least = 1e9;
  double most = 0.0;
  for (int dv = -kReach; dv <= kReach; ++dv) {
    for (int du = -kReach; du <= kReach; ++du) {
      const double w = at(du, dv);
      if (w == 0.0) continue;
      const Vec3d row(du, dv, 1.0);
      matrix += row * row.transpose();
      right += w * row;
      squares += w * w;
      least = std::min(least, w);
      most = std::max(most, w);
    }
  }
  if (at(0, 0) == 0.0 || most - least > 0.5 * at(0, 0)) return Vec3d::Zero();
  const Vec3d slope = matrix.inverse() * right;
  const double off = std::sqrt((squares - slope.dot(right)) / matrix(2, 2));
  if (off > 0.01 * at(0, 0)) return Vec3d::Zero();
  const kernels::StripPlace p = place();
  const double u = static_cast<double>(p.first_u) + column;
  const Vec3d normal(slope.x() * static_cast<double>(p.fx), slope.y() * static_cast<double>(p.fy),
                     slope.z() - slope.x() * u - slope.y() * static_cast<double>(p.v));
  return -normal.normalized();
}

TEST_P(WindowPlanes, AreTheLeastSquaresPlanesOfWhatIsThere) {
  const std::vector<float> inverse = sheet();
  const Normals found = fit(inverse);
  int some = 0;
  int none = 0;
  for (int column = 0; column < static_cast<int>(kStrip); ++column) {
    const auto k = static_cast<std::size_t>(column);
    const Vec3d expected = plainly(inverse, column);
    some += expected.norm() > 0.5 ? 1 : 0;
    none += expected.norm() < 0.5 ? 1 : 0;
    // Sums of 49 inverse depths in single precision leave their slopes 1e-6, times the focal
    // length.
    EXPECT_NEAR(expected.x(), static_cast<double>(found.x[k]), 3e-4) << column;
    EXPECT_NEAR(expected.y(), static_cast<double>(found.y[k]), 3e-4) << column;
    EXPECT_NEAR(expected.z(), static_cast<double>(found.z[k]), 3e-4) << column;
  }
  EXPECT_GT(some, 30);
  EXPECT_GT(none, 10);
}

TEST_P(WindowPlanes, HaveTheSameBitsOnEveryTarget) {
  const std::vector<float> inverse = sheet();
  const Normals here = fit(inverse);
  ASSERT_TRUE(kernels::force_target(kernels::target_names().front()));
  const Normals there = fit(inverse);
  EXPECT_EQ(0, std::memcmp(&here, &there, sizeof here));
}

TEST_P(WindowPlanes, HaveNoneWhereReadingsLieOnALine) {
  std::vector<float> inverse(static_cast<std::size_t>(kStride) * kRows, 0.0F);
  for (std::size_t u = 0; u < kStrip; ++u) inverse[kReach * kStride + kReach + u] = 1.0F;
  const Normals found = fit(inverse);
  for (std::size_t k = 0; k < kStrip; ++k) EXPECT_EQ(0.0F, found.z[k]);
}

}  // namespace
}  // namespace grapnel
