#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

#include "base/rng.h"
#include "pipeline/kernels/reference.h"
#include "pipeline/kernels/target.h"

namespace grapnel {
namespace {

// Single precision keeps 24 bits; sums of up to 25 terms lose at most 5 of them, differences of
// moments a few more. Of the largest value that enters.
constexpr double kRounding = 1e-5;

constexpr int kWidth = 64;
constexpr int kHeight = 12;
constexpr std::ptrdiff_t kStride = kWidth + 16;
constexpr std::size_t kPixels = static_cast<std::size_t>(kStride) * (kHeight + 12);
constexpr std::ptrdiff_t kFirst = 6 * kStride + 8;

/// Every test runs on each target that this machine has: near the loops in double, and the same
/// bits as the first target's.
class WindowKernel : public testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { ASSERT_TRUE(kernels::force_target(GetParam())); }
  void TearDown() override { ASSERT_TRUE(kernels::force_target("")); }

  /// Runs `kernel(out)` on this target and on the first of the machine's; both must give the same
  /// bits.
  template <std::size_t kSize, class Kernel>
  std::array<float, kSize> same_on_first_target(const Kernel& kernel) {
    std::array<float, kSize> here{};
    std::array<float, kSize> there{};
    kernel(here.data());
    EXPECT_TRUE(kernels::force_target(kernels::target_names().front()));
    kernel(there.data());
    EXPECT_TRUE(kernels::force_target(GetParam()));
    EXPECT_EQ(0, std::memcmp(here.data(), there.data(), sizeof here));
    return here;
  }
};

INSTANTIATE_TEST_SUITE_P(OnEveryTarget, WindowKernel, testing::ValuesIn(kernels::target_names()),
                         [](const auto& target) { return target.param; });

/// A tilted sheet 1 m away with a step, noise, holes and far pixels.
struct Sheet {
  std::array<std::vector<float>, 3> plane;
  std::vector<float> range;
  std::vector<float> reach_m2;
  std::vector<float> code;

  Sheet() {
    Rng rng(23);
    for (auto& values : plane) values.assign(kPixels, 0.0F);
    for (std::size_t i = 0; i < kPixels; ++i) {
      const double u = static_cast<double>(i % static_cast<std::size_t>(kStride));
      const double v = static_cast<double>(i / static_cast<std::size_t>(kStride));
      const double z = 1.0 + 0.002 * u + (u > 40.0 ? 0.05 : 0.0) + 0.001 * rng.normal();
      const double chance = rng.uniform();
      plane[0][i] = static_cast<float>(0.004 * (u - 40.0) * z);
      plane[1][i] = static_cast<float>(0.004 * (v - 10.0) * z);
      plane[2][i] = static_cast<float>(z);
      range.push_back(static_cast<float>(z));
      reach_m2.push_back(chance < 0.1 ? -1.0F : 1e-4F);
      code.push_back(chance < 0.2 ? 0.0F : chance < 0.3 ? -1.0F : 1.0F);
      if (chance > 0.97) set_nowhere(i, chance > 0.985 ? 2e15F : 1e15F);
    }
  }
  void set_nowhere(std::size_t i, float x) {
    plane[0][i] = x;
    plane[1][i] = plane[2][i] = 0.0F;
  }
  [[nodiscard]] kernels::RangePlanes range_planes() const {
    return {plane[0].data(), plane[1].data(), plane[2].data(), kStride};
  }
  [[nodiscard]] bool missing(std::ptrdiff_t at) const {
    return plane[0][static_cast<std::size_t>(at)] > 1e14F;
  }
};

constexpr std::size_t kBlock = kernels::kRangeBlock;

kernels::Spread spread_into(float* out) {
  return {out,
          out + kBlock,
          out + 2 * kBlock,
          out + 3 * kBlock,
          out + 4 * kBlock,
          out + 5 * kBlock,
          out + 6 * kBlock,
          out + 7 * kBlock,
          out + 8 * kBlock};
}

TEST_P(WindowKernel, PatchesAreThoseOfLoopsInDouble) {
  const Sheet sheet;
  for (int block = 0; block < 4 * kHeight; ++block) {
    const std::ptrdiff_t at = kFirst + block / 4 * kStride + block % 4 * kernels::kRangeBlock;
    const auto found = same_on_first_target<10 * kBlock>([&](float* out) {
      kernels::fit_patches(sheet.range_planes(), at, out + 9 * kBlock, spread_into(out));
    });
    std::array<float, 10 * kBlock> expected{};
    kernels::reference::fit_patches(sheet.range_planes(), at, expected.data() + 9 * kBlock,
                                    spread_into(expected.data()));
    for (std::size_t i = 0; i < 10 * kBlock; ++i) {
      if (sheet.missing(at + static_cast<std::ptrdiff_t>(i % kBlock))) continue;
      // Offsets are up to 0.1 m, their squares 0.01 m².
      ASSERT_NEAR(found[i], expected[i], 0.1 * kRounding) << block << " " << i;
    }
  }
}

TEST_P(WindowKernel, JumpsAreThoseOfLoopsInDouble) {
  const Sheet sheet;
  const kernels::JumpPlanes planes{sheet.range.data(), sheet.reach_m2.data()};
  for (const std::ptrdiff_t step : {std::ptrdiff_t{1}, std::ptrdiff_t{-1}, kStride, -kStride}) {
    for (int row = 0; row < kHeight; ++row) {
      const std::ptrdiff_t at = kFirst + row * kStride + 32;
      const auto found = same_on_first_target<kBlock>(
          [&](float* out) { kernels::jumps(sheet.range_planes(), planes, at, step, out); });
      std::array<float, kBlock> expected{};
      kernels::reference::jumps(sheet.range_planes(), planes, at, step, expected.data());
      for (std::size_t i = 0; i < kBlock; ++i) {
        if (sheet.missing(at + static_cast<std::ptrdiff_t>(i))) continue;
        ASSERT_NEAR(found[i], expected[i], 10.0 * kRounding) << step << " " << row << " " << i;
      }
    }
  }
}

TEST_P(WindowKernel, SpreadAlongBeamsIsThatOfLoopsInDouble) {
  Sheet sheet;
  Rng rng(29);
  for (std::size_t i = 0; i < kPixels; ++i) {
    const Vec3d normal = Vec3d(0.3 * rng.normal(), 0.3 * rng.normal(), -1.0).normalized();
    for (std::size_t axis = 0; axis < 3; ++axis) {
      sheet.plane[axis][i] = static_cast<float>(normal[static_cast<Eigen::Index>(axis)]);
    }
  }
  for (int row = 0; row < kHeight; ++row) {
    const std::ptrdiff_t at = kFirst + row * kStride + 16;
    const auto found = same_on_first_target<10 * kBlock>([&](float* out) {
      kernels::beam_spread(sheet.range_planes(), sheet.code.data(), at, out + 9 * kBlock,
                           spread_into(out));
    });
    std::array<float, 10 * kBlock> expected{};
    kernels::reference::beam_spread(sheet.range_planes(), sheet.code.data(), at,
                                    expected.data() + 9 * kBlock, spread_into(expected.data()));
    for (std::size_t i = 0; i < 10 * kBlock; ++i) {
      ASSERT_NEAR(found[i], expected[i], kRounding) << row << " " << i;
    }
  }
}

TEST_P(WindowKernel, NearestOfAWindowAreThoseOfLoopsInDouble) {
  const Sheet sheet;
  const kernels::PixelPlanes planes{sheet.plane[0].data(), sheet.plane[1].data(),
                                    sheet.plane[2].data(), kStride};
  for (const auto& [reach, nearest] : {std::pair<int, std::size_t>{1, 5}, {2, 20}, {3, 20}}) {
    const kernels::WindowSelection selection(reach, nearest);
    for (int row = 0; row < kHeight; ++row) {
      const std::ptrdiff_t at = kFirst + row * kStride + 4 * row;
      constexpr std::size_t kLanes = kernels::kLanes;
      const auto found = same_on_first_target<2 * kLanes>([&](float* out) {
        kernels::nearest_in_window(planes, at, selection, out, out + kLanes);
      });
      std::array<float, 2 * kLanes> expected{};
      kernels::reference::nearest_in_window(planes, at, selection, expected.data(),
                                            expected.data() + kLanes);
      for (std::size_t i = 0; i < 2 * kLanes; ++i) {
        // Where a window lacks points the distances are astronomical.
        ASSERT_NEAR(found[i], expected[i],
                    kRounding * std::max(1.0, std::fabs(static_cast<double>(expected[i]))))
            << reach << " " << row << " " << i;
      }
    }
  }
}

TEST_P(WindowKernel, PlanesOfInverseDepthsAreThoseOfLoopsInDouble) {
  Rng rng(31);
  std::vector<float> inverse(kPixels, 0.0F);
  for (std::size_t i = 0; i < kPixels; ++i) {
    const double u = static_cast<double>(i % static_cast<std::size_t>(kStride));
    const double v = static_cast<double>(i / static_cast<std::size_t>(kStride));
    const double z = 1.0 + 0.002 * u - 0.003 * v + (u > 50.0 ? 0.2 : 0.0) + 0.002 * rng.normal();
    if (rng.uniform() < 0.99) inverse[i] = static_cast<float>(1.0 / z);
  }
  std::size_t fitted = 0;
  for (int v = 0; v < kHeight; ++v) {
    kernels::FitRow row;
    row.inverse_m = inverse.data() + kFirst + v * kStride;
    row.stride = kStride;
    row.first_u = -32.0F;
    row.v = static_cast<float>(v) - 6.0F;
    row.fx = row.fy = 250.0F;
    row.max_step = 0.05F;
    const auto found = same_on_first_target<3 * kWidth>(
        [&](float* out) { kernels::fit_planes(row, kWidth, out, out + kWidth, out + 2 * kWidth); });
    std::array<float, 3 * kWidth> expected{};
    kernels::reference::fit_planes(row, kWidth, expected.data(), expected.data() + kWidth,
                                   expected.data() + 2 * kWidth);
    for (std::size_t i = 0; i < 3 * kWidth; ++i) {
      // Slopes are differences of inverse depths of 1, times the focal length over 50.
      ASSERT_NEAR(found[i], expected[i], 5.0 * kRounding) << v << " " << i;
      fitted += expected[i] != 0.0F ? 1U : 0U;
    }
  }
  EXPECT_GT(fitted, 100U);
}

}  // namespace
}  // namespace grapnel
