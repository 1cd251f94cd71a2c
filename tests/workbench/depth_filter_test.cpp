#include "workbench/depth_filter.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "base/input_error.h"
#include "base/rng.h"

namespace grapnel {
namespace {

constexpr int kWidth = 40;
constexpr int kHeight = 30;

/// A noisy wall at 1 m seen through a pinhole, with holes; every depth occurs once.
CloudData noisy_wall() {
  Rng rng(3);
  CloudData cloud;
  cloud.width = kWidth;
  cloud.height = kHeight;
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      const bool hole = rng.below(9) == 0;
      const double z = hole ? std::numeric_limits<double>::quiet_NaN() : rng.uniform(0.99, 1.01);
      cloud.x.push_back(static_cast<float>((u - 19.5) / 35.0 * z));
      cloud.y.push_back(static_cast<float>((v - 14.5) / 35.0 * z));
      cloud.z.push_back(static_cast<float>(z));
    }
  }
  return cloud;
}

/// Median of the readings in the 5 × 5 window, the upper one of an even count.
float brute_median(const CloudData& cloud, int u, int v) {
  std::vector<float> window;
  for (int y = std::max(0, v - 2); y <= std::min(kHeight - 1, v + 2); ++y) {
    for (int x = std::max(0, u - 2); x <= std::min(kWidth - 1, u + 2); ++x) {
      const float z = cloud.z[static_cast<std::size_t>(y * kWidth + x)];
      if (std::isfinite(z)) window.push_back(z);
    }
  }
  std::sort(window.begin(), window.end());
  return window[window.size() / 2];
}

TEST(MedianFilter, GivesTheExactMedianOfEveryWindow) {
  const CloudData before = noisy_wall();
  CloudData after = before;
  EXPECT_EQ(filter_depth(after, "median", {"window=\"5x5\""}), 0U);
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      const auto i = static_cast<std::size_t>(v * kWidth + u);
      if (!std::isfinite(before.z[i])) continue;
      EXPECT_EQ(after.z[i], brute_median(before, u, v));
      EXPECT_NEAR(after.x[i] / after.z[i], before.x[i] / before.z[i], 1e-6);  // on its ray
    }
  }
}

TEST(FlyingPixelFilter, RemovesAPointBetweenTwoSurfaces) {
  CloudData cloud = noisy_wall();
  const std::size_t lonely = 15 * kWidth + 20;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const float z = i == lonely ? 0.7F : 1.0F;
    cloud.x[i] = static_cast<float>((static_cast<double>(i % kWidth) - 19.5) / 35.0) * z;
    cloud.y[i] = static_cast<float>((static_cast<double>(i / kWidth) - 14.5) / 35.0) * z;
    cloud.z[i] = z;
  }
  EXPECT_GE(filter_depth(cloud, "flying_pixels", {}), 1U);
  EXPECT_TRUE(std::isnan(cloud.z[lonely]));
}

TEST(FlyingPixelFilter, PutsAPointBetweenTwoSurfacesOnTheOneThatMostOfItsNeighboursLieOn) {
  CloudData cloud = noisy_wall();
  const std::size_t mixed = 15 * kWidth + 20;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const float z = i == mixed ? 2.0F : (i % kWidth < 20 ? 1.0F : 4.0F);
    cloud.x[i] = static_cast<float>((static_cast<double>(i % kWidth) - 19.5) / 35.0) * z;
    cloud.y[i] = static_cast<float>((static_cast<double>(i / kWidth) - 14.5) / 35.0) * z;
    cloud.z[i] = z;
  }
  EXPECT_EQ(filter_depth(cloud, "flying_pixels", {}), 0U);
  EXPECT_NEAR(cloud.z[mixed], 4.0F, 1e-4F);  // a count is 4 m / 65535
  EXPECT_NEAR(cloud.x[mixed], 0.5F / 35.0F * 4.0F, 1e-5F);
}

TEST(DepthFilters, RefuseACloudWithoutGridAndAnUnknownKey) {
  CloudData cloud = noisy_wall();
  EXPECT_THROW(filter_depth(cloud, "median", {"windw=5"}), InputError);
  cloud.width = kWidth * kHeight;
  cloud.height = 1;
  EXPECT_THROW(filter_depth(cloud, "median", {}), InputError);
}

}  // namespace
}  // namespace grapnel
