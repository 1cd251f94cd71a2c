// Kernels that look at pictures of depth: edges, nearer surfaces, samples on a plane.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "base/rng.h"
#include "pipeline/kernels/edge_candidates.h"
#include "pipeline/kernels/near_plane.h"
#include "pipeline/kernels/nearer_row.h"
#include "pipeline/kernels/target.h"

namespace grapnel {
namespace {

class DepthPictureKernels : public testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { ASSERT_TRUE(kernels::force_target(GetParam())); }
  void TearDown() override { ASSERT_TRUE(kernels::force_target("")); }
};

INSTANTIATE_TEST_SUITE_P(OnEveryTarget, DepthPictureKernels,
                         testing::ValuesIn(kernels::target_names()),
                         [](const auto& target) { return target.param; });

constexpr std::size_t kWidth = 61;
const kernels::EdgeLaw kEdges = {0.001F, 1.4e-3F, 1e-4F, 575.0F};

/// Three rows; the middle one's first and last pixel are neighbours only.
struct Picture {
  std::vector<std::uint16_t> depth = std::vector<std::uint16_t>(3 * kWidth, 1000);
  std::vector<std::uint8_t> label = std::vector<std::uint8_t>(3 * kWidth, 1);

  [[nodiscard]] kernels::LabelledRow middle(bool labelled) const {
    return {depth.data() + kWidth + 1, kWidth, labelled ? label.data() + kWidth + 1 : nullptr,
            kWidth};
  }
};

std::vector<std::int32_t> candidates(const Picture& picture, bool labelled) {
  std::vector<std::int32_t> found(kWidth + kernels::kCandidatePad);
  found.resize(
      kernels::edge_candidates(picture.middle(labelled), kWidth - 2, kEdges, found.data()));
  return found;
}

TEST_P(DepthPictureKernels, EdgeCandidatesAreThoseOfThePlainLoop) {
  Rng rng(5);
  Picture picture;
  for (std::uint16_t& depth : picture.depth) {
    if (rng.below(9) == 0) depth = 0;
    // The step at 1 m is 8 · 1.4 + 6000 / 575 = 21.6 counts.
    if (rng.below(5) == 0) depth = static_cast<std::uint16_t>(1000 + rng.below(40));
  }
  for (std::uint8_t& label : picture.label) label = rng.below(12) == 0 ? 0 : 3;
  for (const bool labelled : {false, true}) {
    std::vector<std::int32_t> plain(kWidth + kernels::kCandidatePad);
    plain.resize(kernels::reference::edge_candidates(picture.middle(labelled), kWidth - 2, kEdges,
                                                     plain.data()));
    EXPECT_GT(plain.size(), 10U);
    EXPECT_LT(plain.size(), 50U);
    EXPECT_EQ(candidates(picture, labelled), plain);
  }
}

TEST_P(DepthPictureKernels, EdgeCandidatesLieBesideGapsBackgroundAndSteps) {
  Picture picture;
  EXPECT_TRUE(candidates(picture, true).empty());
  picture.depth[kWidth + 1 + 10] = 0;         // a gap: both sides of it
  picture.label[1 + 30] = 0;                  // background above
  picture.depth[2 * kWidth + 1 + 40] = 1022;  // a step of 21.6 counts and more below
  picture.depth[2 * kWidth + 1 + 50] = 1021;  // and none
  EXPECT_EQ(candidates(picture, true), (std::vector<std::int32_t>{9, 11, 30, 40}));
  EXPECT_EQ(candidates(picture, false), (std::vector<std::int32_t>{9, 11, 40}));
}

TEST_P(DepthPictureKernels, TheNearerOfTwoRowsIsThatOfThePlainLoop) {
  const kernels::NearerLaw law = {1.5F, 1.4e-3F, 1e-4F};
  constexpr std::size_t kCount = 101;
  Rng rng(6);
  std::vector<float> first(kCount + kernels::kNearerPad, 0.0F);
  std::vector<float> second(first);
  for (std::size_t i = 0; i < kCount; ++i) {
    if (rng.below(5) != 0) first[i] = static_cast<float>(rng.uniform(0.99, 1.01));
    if (rng.below(5) != 0) second[i] = static_cast<float>(rng.uniform(0.99, 1.01));
  }
  // By hand: 1.5 · 1.4 mm at 1 m is 2.1 mm.
  const float by_hand[][3] = {{0.0F, 0.0F, 0.0F},   {1.0F, 0.0F, 1.0F},    {0.0F, 1.0F, -1.0F},
                              {1.0F, 1.002F, 0.0F}, {1.0F, 1.0022F, 1.0F}, {1.0022F, 1.0F, -1.0F},
                              {1.002F, 1.0F, 0.0F}};
  std::size_t at = 0;
  for (const auto& [a, b, wanted] : by_hand) {
    first[at] = a;
    second[at++] = b;
  }
  std::vector<std::int8_t> side(kCount + kernels::kNearerPad);
  std::vector<std::int8_t> plain(side);
  kernels::nearer_row(first.data(), second.data(), kCount, law, side.data());
  kernels::reference::nearer_row(first.data(), second.data(), kCount, law, plain.data());
  side.resize(kCount);
  plain.resize(kCount);
  EXPECT_EQ(side, plain);
  at = 0;
  for (const auto& [a, b, wanted] : by_hand) EXPECT_EQ(side[at++], static_cast<int>(wanted));
}

TEST_P(DepthPictureKernels, SamplesOnAPlaneAreCounted) {
  constexpr std::size_t kCount = 203;
  Rng rng(7);
  std::vector<float> u(kCount), v(kCount), inverse(kCount), tolerance(kCount);
  std::size_t near = 0;
  for (std::size_t i = 0; i < kCount; ++i) {
    u[i] = static_cast<float>(rng.below(640));
    v[i] = static_cast<float>(rng.below(480));
    tolerance[i] = 0.01F;
    const bool on_plane = rng.below(3) != 0;
    near += on_plane ? 1 : 0;
    inverse[i] = 1e-4F * u[i] - 2e-4F * v[i] + 0.9F + (on_plane ? 0.009F : -0.011F);
  }
  const kernels::InverseSamples samples{u.data(), v.data(), inverse.data(), tolerance.data()};
  for (const std::size_t count : {std::size_t{0}, std::size_t{7}, std::size_t{64}, kCount}) {
    EXPECT_EQ(kernels::count_near_plane(samples, count, 1e-4F, -2e-4F, 0.9F),
              kernels::reference::count_near_plane(samples, count, 1e-4F, -2e-4F, 0.9F));
  }
  EXPECT_EQ(kernels::count_near_plane(samples, kCount, 1e-4F, -2e-4F, 0.9F), near);
}

}  // namespace
}  // namespace grapnel
