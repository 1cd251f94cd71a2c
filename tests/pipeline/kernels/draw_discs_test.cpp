#include "pipeline/kernels/draw_discs.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <string>
#include <vector>

#include "base/rng.h"
#include "pipeline/kernels/target.h"

namespace grapnel {
namespace {

constexpr std::int32_t kLeft = 11;
constexpr std::int32_t kTop = 7;
constexpr std::int32_t kWidth = 53;
constexpr std::int32_t kHeight = 37;

class DrawDiscs : public testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { ASSERT_TRUE(kernels::force_target(GetParam())); }
  void TearDown() override { ASSERT_TRUE(kernels::force_target("")); }
};

INSTANTIATE_TEST_SUITE_P(OnEveryTarget, DrawDiscs, testing::ValuesIn(kernels::target_names()),
                         [](const auto& target) { return target.param; });

struct Canvas {
  static constexpr std::size_t kPixels = static_cast<std::size_t>(kWidth) * kHeight;
  std::vector<float> z = std::vector<float>(kPixels + kernels::kDiscPad, 0.0F);
  std::vector<std::int32_t> point = std::vector<std::int32_t>(kPixels + kernels::kDiscPad, -1);
  [[nodiscard]] kernels::DiscImage image() { return {z.data(), point.data(), kLeft, kTop, kWidth}; }
};

/// Discs of 1 to 20 pixels across, some at the image's ends, some of equal depth.
std::vector<kernels::Disc> random_discs(std::size_t count) {
  Rng rng(9);
  std::vector<kernels::Disc> discs;
  for (std::size_t i = 0; i < count; ++i) {
    kernels::Disc disc;
    disc.u0 = kLeft + static_cast<std::int32_t>(rng.below(kWidth));
    disc.v0 = kTop + static_cast<std::int32_t>(rng.below(kHeight));
    disc.u1 = std::min(kLeft + kWidth - 1, disc.u0 + static_cast<std::int32_t>(rng.below(20)));
    disc.v1 = std::min(kTop + kHeight - 1, disc.v0 + static_cast<std::int32_t>(rng.below(20)));
    const bool level = i % 5 == 0;
    disc.start = level ? 1.25F : static_cast<float>(rng.uniform(0.9, 1.3));
    disc.step_u = level ? 0.0F : static_cast<float>(rng.uniform(-0.01, 0.01));
    disc.step_v = level ? 0.0F : static_cast<float>(rng.uniform(-0.01, 0.01));
    disc.nearest = 1.5F;
    disc.farthest = 0.8F;
    disc.point = static_cast<std::int32_t>(i);
    discs.push_back(disc);
  }
  return discs;
}

TEST_P(DrawDiscs, GivesTheBitsOfThePlainLoops) {
  const std::vector<kernels::Disc> discs = random_discs(400);
  Canvas fast;
  Canvas plain;
  kernels::draw_discs(discs.data(), discs.size(), fast.image());
  kernels::reference::draw_discs(discs.data(), discs.size(), plain.image());
  EXPECT_EQ(std::memcmp(fast.z.data(), plain.z.data(), fast.z.size() * sizeof(float)), 0);
  EXPECT_EQ(fast.point, plain.point);
}

TEST_P(DrawDiscs, KeepsTheNearestAndOfEqualOnesTheFirst) {
  kernels::Disc disc;
  disc.u0 = kLeft + 3;
  disc.u1 = kLeft + 14;
  disc.v0 = disc.v1 = kTop + kHeight - 1;
  disc.start = 1.0F;
  disc.nearest = 2.0F;
  std::vector<kernels::Disc> discs(4, disc);
  for (std::size_t i = 0; i < 4; ++i) discs[i].point = static_cast<std::int32_t>(i);
  discs[2].start = 1.1F;
  discs[2].u1 = kLeft + 5;
  discs[3].start = 0.9F;
  Canvas canvas;
  kernels::draw_discs(discs.data(), discs.size(), canvas.image());
  for (std::int32_t u = 0; u < kWidth; ++u) {
    const std::int32_t expected = u < 3 || u > 14 ? -1 : (u <= 5 ? 2 : 0);
    EXPECT_EQ(canvas.point[static_cast<std::size_t>((kHeight - 1) * kWidth + u)], expected) << u;
  }
}

TEST_P(DrawDiscs, InvertsARowAndNothingBehindIt) {
  Rng rng(4);
  for (const std::size_t count : {0U, 1U, 7U, 8U, 29U}) {
    std::vector<float> row(count + kernels::kDiscPad);
    for (float& value : row)
      value = rng.below(4) == 0 ? 0.0F : static_cast<float>(rng.uniform(0.5, 2.0));
    std::vector<float> plain = row;
    const float largest = kernels::invert_row(row.data(), count);
    EXPECT_EQ(largest, kernels::reference::invert_row(plain.data(), count));
    EXPECT_EQ(row, plain) << count;
  }
}

}  // namespace
}  // namespace grapnel
