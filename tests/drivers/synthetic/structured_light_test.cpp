#include "drivers/synthetic/structured_light.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <vector>

#include "base/math.h"

namespace grapnel {
namespace {

const Intrinsics kCamera{640, 480, 575.0, 575.0, 319.5, 239.5};
constexpr double kBaseline_m = 0.075;
constexpr double kFocalBaseline = 575.0 * 0.075;  // px·m
constexpr double kFine_m = 1e-4;                  // a count that hides nothing of the noise

/// One surface per pixel, all facing the camera unless changed.
struct Wall {
  std::vector<float> inverse_depth;
  std::vector<float> cosine;
  std::vector<float> albedo;

  explicit Wall(double z_m)
      : inverse_depth(pixels(), static_cast<float>(1.0 / z_m)),
        cosine(pixels(), 1.0f),
        albedo(pixels(), 0.6f) {}

  static std::size_t pixels() { return 640u * 480u; }
  [[nodiscard]] SurfaceImages images() const {
    SurfaceImages images;
    images.inverse_depth = {inverse_depth.data(), kCamera.width, kCamera.height};
    images.cos_incidence = {cosine.data(), kCamera.width, kCamera.height};
    images.albedo = {albedo.data(), kCamera.width, kCamera.height};
    return images;
  }
};

struct Depth {
  std::vector<std::uint16_t> counts = std::vector<std::uint16_t>(Wall::pixels());
  double metres_per_unit = kFine_m;

  Depth(const Wall& wall, const StructuredLightParams& params, std::uint64_t frame = 0,
        double unit_m = kFine_m)
      : metres_per_unit(unit_m) {
    StructuredLight sensor(kCamera, kBaseline_m, unit_m, params);
    sensor.measure(wall.images(), 42, frame, {counts.data(), kCamera.width, kCamera.height});
  }
  [[nodiscard]] double at_m(int u, int v) const {
    return counts[static_cast<std::size_t>(v * kCamera.width + u)] * metres_per_unit;
  }
};

StructuredLightParams plain() {
  StructuredLightParams params;
  params.mixed_ratio = 0.0;
  params.invalid_columns = 0;
  return params;
}

double sigma_m(const Depth& depth, double z_m) {
  double sum = 0.0;
  for (const std::uint16_t count : depth.counts) {
    const double error_m = count * depth.metres_per_unit - z_m;
    sum += error_m * error_m;
  }
  return std::sqrt(sum / static_cast<double>(depth.counts.size()));
}

TEST(StructuredLight, DepthErrorGrowsWithTheSquareOfDistance) {
  // Khoshelham and Elberink 2012: sigma_z = 1.425e-3 z². 307200 pixels in windows of 49 that share
  // their error are 6300 independent ones: 1.8 % at two standard deviations. The noise before
  // quantisation is 0.4 steps, so its quantisation error still depends on where between two steps
  // the depth lies: Fourier's first term, exp(-2π² 0.4²), moves the sum by up to 6.5 %.
  for (const double z_m : {0.7, 1.0, 1.37, 2.0, 3.1}) {
    Wall wall(z_m);
    wall.albedo.assign(Wall::pixels(), 1.0f);
    const Depth depth(wall, plain());
    EXPECT_NEAR(sigma_m(depth, z_m) / (1.425e-3 * z_m * z_m), 1.0, 0.083) << z_m;
  }
}

TEST(StructuredLight, NoiseIsIndependentFromFrameToFrame) {
  StructuredLightParams params = plain();
  params.disparity_step_px = 0.0;
  const Wall wall(1.0);
  const Depth first(wall, params, 0);
  const Depth second(wall, params, 1);
  double product = 0.0;
  for (std::size_t i = 0; i < Wall::pixels(); ++i) {
    product += (first.counts[i] * kFine_m - 1.0) * (second.counts[i] * kFine_m - 1.0);
  }
  const double correlation = product / static_cast<double>(Wall::pixels()) / (1.425e-3 * 1.425e-3);
  EXPECT_NEAR(correlation, 0.0, 0.05);  // four standard deviations of 6300 independent samples
}

TEST(StructuredLight, NoiseIsCorrelatedOverItsWindowAndNotBeyond) {
  // A moving average over n pixels has the autocorrelation 1 - lag / n, 0 from lag n on.
  StructuredLightParams params = plain();
  params.disparity_step_px = 0.0;
  params.correlation_px = 7;
  const Depth depth(Wall(1.0), params);
  const auto correlation = [&depth](int lag_u, int lag_v) {
    double product = 0.0;
    double square = 0.0;
    for (int v = 0; v + lag_v < kCamera.height; ++v) {
      for (int u = 0; u + lag_u < kCamera.width; ++u) {
        const double error = depth.at_m(u, v) - 1.0;
        product += error * (depth.at_m(u + lag_u, v + lag_v) - 1.0);
        square += error * error;
      }
    }
    return product / square;
  };
  for (const int lag : {1, 3, 5, 7, 10}) {
    const double expected = std::max(0.0, 1.0 - lag / 7.0);
    EXPECT_NEAR(correlation(lag, 0), expected, 0.05) << lag;
    EXPECT_NEAR(correlation(0, lag), expected, 0.05) << lag;
  }
}

TEST(StructuredLight, DisparityComesInEighthsOfAPixel) {
  const double z_m = 1.0;
  const Depth depth(Wall(z_m), plain(), 0, 1e-5 * 2);
  std::set<std::uint16_t> levels(depth.counts.begin(), depth.counts.end());
  ASSERT_GE(levels.size(), 3u);
  for (const std::uint16_t level : levels) {
    const double disparity_px = kFocalBaseline / (level * 2e-5);
    // Half a count of 20 µm is 0.4e-3 px of disparity at 1 m.
    EXPECT_NEAR(disparity_px * 8.0, std::round(disparity_px * 8.0), 8.0 * 0.5e-3) << level;
  }
  // One step is z² / (8 f b): 2.9 mm at 1 m.
  const auto low = *levels.begin();
  const auto next = *std::next(levels.begin());
  EXPECT_NEAR((next - low) * 2e-5, z_m * z_m / (8.0 * kFocalBaseline), 1e-4);
}

TEST(StructuredLight, ShadowIsAsWideAsTheDifferenceOfDisparities) {
  // A slab at z1 in front of a wall at z2: f b (1/z1 - 1/z2) columns of the wall are dark on the
  // side away from the projector.
  StructuredLightParams params = plain();
  params.noise = false;
  const double near_m = 0.8;
  const double far_m = 1.2;
  Wall wall(far_m);
  constexpr int kFirst = 300;
  constexpr int kLast = 399;
  constexpr int kOffset = 120;
  constexpr int kColumns = 640 + kOffset;
  std::vector<float> projector(static_cast<std::size_t>(kColumns) * 480u, 0.0f);
  for (int v = 0; v < kCamera.height; ++v) {
    for (int u = kFirst; u <= kLast; ++u) {
      wall.inverse_depth[static_cast<std::size_t>(v * 640 + u)] = static_cast<float>(1.0 / near_m);
    }
    const double shift_px = kFocalBaseline / near_m;
    for (int column = 0; column < kColumns; ++column) {
      const double u = column - kOffset + shift_px;
      if (u >= kFirst && u <= kLast) {
        projector[static_cast<std::size_t>(v * kColumns + column)] =
            static_cast<float>(1.0 / near_m);
      }
    }
  }
  SurfaceImages images = wall.images();
  images.projector_inverse_depth = {projector.data(), kColumns, kCamera.height};
  images.projector_offset_px = kOffset;
  StructuredLight sensor(kCamera, kBaseline_m, 0.001, params);
  std::vector<std::uint16_t> depth(Wall::pixels());
  sensor.measure(images, 1, 0, {depth.data(), kCamera.width, kCamera.height});
  const std::uint16_t* row = depth.data() + 240 * 640;
  int width_px = 0;
  for (int u = kFirst - 1; row[u] == 0; --u) ++width_px;
  EXPECT_NEAR(width_px, kFocalBaseline * (1.0 / near_m - 1.0 / far_m), 1.5);
  EXPECT_NE(row[kLast + 1], 0) << "no shadow on the projector's side";
  EXPECT_NE(row[(kFirst + kLast) / 2], 0) << "the slab does not shade itself";
}

TEST(StructuredLight, ReadsNothingAtGrazingIncidence) {
  Wall wall(1.0);
  for (std::size_t i = 0; i < Wall::pixels() / 2; ++i) {
    wall.cosine[i] = static_cast<float>(std::cos(82.0 / 180.0 * math::kPi));
  }
  for (std::size_t i = Wall::pixels() / 2; i < Wall::pixels(); ++i) {
    wall.cosine[i] = static_cast<float>(std::cos(60.0 / 180.0 * math::kPi));
  }
  const Depth depth(wall, plain());
  for (std::size_t i = 0; i < Wall::pixels() / 2; ++i) ASSERT_EQ(depth.counts[i], 0);
  for (std::size_t i = Wall::pixels() / 2; i < Wall::pixels(); ++i) ASSERT_NE(depth.counts[i], 0);
}

TEST(StructuredLight, LosesDarkSurfacesWithDistance) {
  // Signal = albedo cos / z² against 0.03: albedo 0.05 gives 0.05 at 1 m (some readings fail) and
  // 0.0125 at 2 m (all do).
  const auto share = [](double z_m) {
    Wall wall(z_m);
    wall.albedo.assign(Wall::pixels(), 0.05f);
    const Depth depth(wall, plain());
    double readings = 0.0;
    for (const std::uint16_t count : depth.counts) readings += count != 0 ? 1.0 : 0.0;
    return readings / static_cast<double>(Wall::pixels());
  };
  EXPECT_EQ(share(2.0), 0.0);
  // Fails where 0.05 < 0.03 (1 + 2 chance), chance even in 0…1: two thirds of the patches.
  EXPECT_NEAR(share(1.0), 1.0 / 3.0, 0.01);
  EXPECT_EQ(share(0.6), 1.0);
}

TEST(StructuredLight, MixesDepthsAtEdgesOnly) {
  StructuredLightParams params = plain();
  params.noise = false;
  params.disparity_step_px = 0.0;
  params.mixed_ratio = 0.5;
  Wall wall(1.2);
  for (int v = 0; v < kCamera.height; ++v) {
    for (int u = 320; u < 640; ++u) {
      wall.inverse_depth[static_cast<std::size_t>(v * 640 + u)] = 1.0f;
    }
  }
  const Depth depth(wall, params);
  int mixed = 0;
  for (int v = 1; v + 1 < kCamera.height; ++v) {
    EXPECT_NEAR(depth.at_m(318, v), 1.2, kFine_m);
    EXPECT_NEAR(depth.at_m(321, v), 1.0, kFine_m);
    for (const int u : {319, 320}) {
      const double z_m = depth.at_m(u, v);
      EXPECT_GE(z_m, 1.0 - kFine_m);
      EXPECT_LE(z_m, 1.2 + kFine_m);
      if (z_m > 1.0 + 2 * kFine_m && z_m < 1.2 - 2 * kFine_m) ++mixed;
    }
  }
  // 956 edge pixels, each mixed with probability one half: four standard deviations are 62.
  EXPECT_NEAR(mixed, 478, 62);
}

TEST(StructuredLight, KeepsToItsRangeAndItsBlindColumns) {
  StructuredLightParams params = plain();
  params.invalid_columns = 8;
  const Depth depth(Wall(1.0), params);
  EXPECT_EQ(depth.at_m(7, 100), 0.0);
  EXPECT_GT(depth.at_m(8, 100), 0.0);
  EXPECT_EQ(Depth(Wall(0.3), params).at_m(300, 100), 0.0);
  EXPECT_EQ(Depth(Wall(4.5), params).at_m(300, 100), 0.0);
}

TEST(StructuredLight, SameSeedAndFrameGiveTheSameBits) {
  const StructuredLightParams params;
  const Wall wall(1.0);
  EXPECT_EQ(Depth(wall, params, 3).counts, Depth(wall, params, 3).counts);
  EXPECT_NE(Depth(wall, params, 3).counts, Depth(wall, params, 4).counts);
}

}  // namespace
}  // namespace grapnel
