#include "pipeline/kernels/compare_row.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <string>
#include <vector>

#include "base/rng.h"
#include "pipeline/kernels/target.h"

namespace grapnel {
namespace {

using kernels::Met;

constexpr std::ptrdiff_t kWidth = 61;
constexpr int kRim = 2;

class CompareRow : public testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { ASSERT_TRUE(kernels::force_target(GetParam())); }
  void TearDown() override { ASSERT_TRUE(kernels::force_target("")); }
};

INSTANTIATE_TEST_SUITE_P(OnEveryTarget, CompareRow, testing::ValuesIn(kernels::target_names()),
                         [](const auto& target) { return target.param; });

/// Rows with room beside and about, and the middle one's normals and readings.
struct Rows {
  static constexpr std::size_t kCount = kWidth - 2 * kRim;
  std::vector<float> z = std::vector<float>((2 * kRim + 1) * kWidth + kernels::kComparePad, 1.0F);
  std::vector<float> measured = std::vector<float>(kCount + kernels::kComparePad, 1.0F);
  std::vector<float> nx = std::vector<float>(kCount + kernels::kComparePad, 0.0F);
  std::vector<float> ny = nx;
  std::vector<float> nz = std::vector<float>(kCount + kernels::kComparePad, -1.0F);
  kernels::CompareLaw law;
  kernels::Motion motion;

  Rows() {
    law.sigma_per_m2 = 1.4e-3F;
    law.floor_m = 0.004F;
    law.rim_px = kRim;
    law.first_x = -0.05F;
    law.step_x = 1.0F / 500.0F;
    law.y = 0.1F;
  }
  [[nodiscard]] float& at(int column, int row) {
    return z[static_cast<std::size_t>((row + kRim) * kWidth + kRim + column)];
  }
};

struct Result {
  std::vector<std::int32_t> met = std::vector<std::int32_t>(Rows::kCount + kernels::kComparePad);
  std::vector<float> off, footprint, nx, ny, nz;
  Result() {
    for (std::vector<float>* plane : {&off, &footprint, &nx, &ny, &nz}) plane->resize(met.size());
  }
};

template <class Kernel>
Result run(Rows& rows, const Kernel& kernel) {
  Result result;
  const kernels::PredictedRow predicted{&rows.at(0, 0), kWidth, rows.nx.data(), rows.ny.data(),
                                        rows.nz.data()};
  const kernels::ComparedRow out{result.met.data(), result.off.data(), result.footprint.data(),
                                 result.nx.data(),  result.ny.data(),  result.nz.data()};
  kernel(predicted, rows.measured.data(), Rows::kCount, rows.motion, rows.law, out);
  for (std::vector<float>* plane :
       {&result.off, &result.footprint, &result.nx, &result.ny, &result.nz}) {
    plane->resize(Rows::kCount);
  }
  result.met.resize(Rows::kCount);
  return result;
}

TEST_P(CompareRow, GivesTheBitsOfThePlainLoop) {
  Rng rng(21);
  Rows rows;
  const Pose turn(Eigen::AngleAxisd(0.4, Vec3d(1.0, 2.0, -0.5).normalized()));
  rows.motion = kernels::motion_of(turn);
  for (float& z : rows.z) {
    if (rng.below(30) == 0)
      z = rng.below(2) == 0 ? 0.0F : static_cast<float>(rng.uniform(0.9, 1.1));
  }
  rows.at(10, 0) = 0.0F;
  for (std::size_t k = 0; k < Rows::kCount; ++k) {
    const std::uint32_t kind = rng.below(8);
    rows.measured[k] = kind == 0 ? 0.0F : static_cast<float>(rng.uniform(0.99, 1.01));
    if (kind == 1) rows.measured[k] = static_cast<float>(-rng.uniform(0.997, 1.003));
    const Vec3d n = Vec3d(rng.uniform(-1.0, 1.0), rng.uniform(-1.0, 1.0), -1.0).normalized();
    rows.nx[k] = static_cast<float>(n.x());
    rows.ny[k] = static_cast<float>(n.y());
    rows.nz[k] = static_cast<float>(n.z());
  }
  const Result fast = run(rows, kernels::compare_row);
  const Result plain = run(rows, kernels::reference::compare_row);
  EXPECT_EQ(fast.met, plain.met);
  const auto same = [](const std::vector<float>& a, const std::vector<float>& b) {
    return std::memcmp(a.data(), b.data(), a.size() * sizeof(float)) == 0;
  };
  EXPECT_TRUE(same(fast.off, plain.off));
  EXPECT_TRUE(same(fast.footprint, plain.footprint));
  EXPECT_TRUE(same(fast.nx, plain.nx) && same(fast.ny, plain.ny) && same(fast.nz, plain.nz));
  for (const Met met : {Met::Nothing, Met::AtStep, Met::NoReading, Met::Behind, Met::Before,
                        Met::Ground, Met::Within}) {
    EXPECT_NE(std::count(plain.met.begin(), plain.met.end(), static_cast<int>(met)), 0)
        << static_cast<int>(met);
  }
}

TEST_P(CompareRow, NamesWhatAPlateMeets) {
  // A plate across the view at 1 m, its limit the larger of 4.2 and 4 mm.
  Rows rows;
  rows.measured[3] = 0.0F;
  rows.measured[4] = 1.005F;
  rows.measured[5] = 0.995F;
  rows.measured[6] = -1.003F;
  rows.measured[7] = -1.5F;
  rows.measured[8] = 1.004F;
  rows.at(30, 0) = 0.0F;     // a hole: what lies within the rim of it is at a step
  rows.at(45, kRim) = 1.1F;  // below one pixel
  const Result result = run(rows, kernels::compare_row);
  for (std::size_t k = 0; k < Rows::kCount; ++k) {
    Met expected = Met::Within;
    if (k == 3) expected = Met::NoReading;
    if (k == 4 || k == 7) expected = Met::Behind;
    if (k == 5) expected = Met::Before;
    if (k == 6) expected = Met::Ground;
    if (k == 30) expected = Met::Nothing;
    if (k == 28 || k == 32 || k == 45) expected = Met::AtStep;
    EXPECT_EQ(static_cast<Met>(result.met[k]), expected) << k;
  }
  // Across the view the way along the normal is the difference in depth.
  EXPECT_NEAR(result.off[4], 0.005, 1e-6);
  EXPECT_NEAR(result.off[6], 0.003, 1e-6);
  // A pixel of a plate across the view at z is z / fx by z / fy, off the axis as well.
  EXPECT_NEAR(result.footprint[20], 1.0, 1e-6);
}

}  // namespace
}  // namespace grapnel
