#include "pipeline/kernels/outline_pixels.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "base/rng.h"
#include "pipeline/kernels/target.h"

namespace grapnel {
namespace {

constexpr std::ptrdiff_t kWidth = 60;
const kernels::OutlineLaw kLaw = {0.02F, 1.4e-3F, 1e-4F};

class OutlinePixels : public testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { ASSERT_TRUE(kernels::force_target(GetParam())); }
  void TearDown() override { ASSERT_TRUE(kernels::force_target("")); }

  /// Of the middle one of three rows, all but its first and last pixel.
  static std::vector<std::int32_t> find(const std::vector<float>& rows) {
    std::vector<std::int32_t> found(kWidth + kernels::kOutlinePad);
    found.resize(
        kernels::outline_pixels(rows.data() + kWidth + 1, kWidth, kWidth - 2, kLaw, found.data()));
    return found;
  }
};

INSTANTIATE_TEST_SUITE_P(OnEveryTarget, OutlinePixels, testing::ValuesIn(kernels::target_names()),
                         [](const auto& target) { return target.param; });

std::vector<float> rows_at(float z_m) {
  return std::vector<float>(3 * kWidth + kernels::kOutlinePad + 1, z_m);
}

TEST_P(OutlinePixels, AreThoseOfThePlainLoop) {
  Rng rng(8);
  std::vector<float> rows = rows_at(1.0F);
  for (float& z : rows) {
    if (rng.below(9) == 0) z = 0.0F;
    if (rng.below(9) == 0) z = static_cast<float>(rng.uniform(0.95, 1.1));
  }
  std::vector<std::int32_t> plain(kWidth + kernels::kOutlinePad);
  plain.resize(kernels::reference::outline_pixels(rows.data() + kWidth + 1, kWidth, kWidth - 2,
                                                  kLaw, plain.data()));
  EXPECT_GT(plain.size(), 10U);
  EXPECT_LT(plain.size(), 50U);
  EXPECT_EQ(find(rows), plain);
}

TEST_P(OutlinePixels, LieBesideNothingAndBesideWhatFallsAwayButNotOnASlope) {
  std::vector<float> rows = rows_at(1.0F);
  EXPECT_TRUE(find(rows).empty());
  rows[kWidth + 1 + 20] = 0.0F;       // nothing: both sides of it
  rows[1 + 40] = 1.1F;                // above a pixel, far behind it
  rows[2 * kWidth + 1 + 50] = 1.03F;  // 0.02 + 8 sigma is 0.031 behind
  EXPECT_EQ(find(rows), (std::vector<std::int32_t>{19, 21, 40}));
}

TEST_P(OutlinePixels, TheWayOutIsThatOfThePlainLoop) {
  constexpr int kReach = kernels::kOutwardReach;
  constexpr int kRows = 2 * kReach + 1;
  Rng rng(11);
  std::vector<float> rows(kRows * kWidth + kernels::kOutlinePad, 1.0F);
  for (float& z : rows) {
    if (rng.below(5) == 0) z = 0.0F;
    if (rng.below(5) == 0) z = static_cast<float>(rng.uniform(0.95, 1.1));
  }
  const float* const middle = rows.data() + kReach * kWidth;
  std::vector<std::int32_t> found;
  for (std::int32_t u = kReach; u < kWidth - kReach; ++u) {
    if (middle[u] > 0.0F) found.push_back(u);
  }
  ASSERT_GT(found.size(), 30U);
  std::vector<float> u(found.size()), v(found.size()), plain_u(u), plain_v(v);
  kernels::outward_of(middle, kWidth, found.data(), found.size(), kLaw, u.data(), v.data());
  kernels::reference::outward_of(middle, kWidth, found.data(), found.size(), kLaw, plain_u.data(),
                                 plain_v.data());
  EXPECT_EQ(u, plain_u);
  EXPECT_EQ(v, plain_v);
}

TEST_P(OutlinePixels, TheWayOutOfAHalfPlaneIsAcrossItsEdge) {
  constexpr int kReach = kernels::kOutwardReach;
  std::vector<float> rows((2 * kReach + 1) * kWidth + kernels::kOutlinePad, 0.0F);
  for (int row = 0; row < 2 * kReach + 1; ++row) {
    for (int u = 0; u <= 30; ++u) rows[static_cast<std::size_t>(row * kWidth + u)] = 1.0F;
  }
  const std::int32_t edge = 30;
  float u = 0.0F;
  float v = 0.0F;
  kernels::outward_of(rows.data() + kReach * kWidth, kWidth, &edge, 1, kLaw, &u, &v);
  // Open are the columns 1, 2 and 3 to the right, in seven rows.
  EXPECT_EQ(u, 42.0F);
  EXPECT_EQ(v, 0.0F);
}

}  // namespace
}  // namespace grapnel
