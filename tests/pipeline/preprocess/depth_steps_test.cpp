#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <vector>

#include "base/rng.h"
#include "pipeline/preprocess/background.h"
#include "pipeline/preprocess/decimate.h"
#include "pipeline/preprocess/depth_outliers.h"
#include "pipeline/preprocess/median.h"
#include "pipeline/preprocess/organize.h"
#include "pipeline/preprocess/segment.h"
#include "tests/pipeline/support/surfaces.h"

namespace grapnel {
namespace {

constexpr int kWidth = 160;
constexpr int kHeight = 120;
constexpr double kFocal_px = 140.0;

/// A workspace with every depth step.
struct Steps {
  WorkingDepth work;
  DepthMedian median{{}};
  DepthOutliers outliers{{}};
  BackgroundRemoval background;
  Segmenter segmenter;
  test::ArenaMemory memory;

  explicit Steps(const BackgroundParams& background_params = {},
                 const SegmentParams& segment_params = {})
      : background(background_params), segmenter(segment_params), memory([&](Arena& arena) {
          const Limits limits = test::small_limits();
          work.reserve(arena, limits);
          median.reserve(arena, limits);
          outliers.reserve(arena, limits);
          background.reserve(arena, limits);
          segmenter.reserve(arena, limits);
        }) {}
};

const Vec3d kFacing(0.0, 0.0, -1.0);

/// A table 1 m away, tilted, with a 0.1 m high block on it.
test::TestFrame table_with_block() {
  test::TestFrame frame(kWidth, kHeight, kFocal_px);
  const Vec3d tilted = Vec3d(0.0, -0.3, -1.0).normalized();
  frame.draw_plane(tilted, 1.0, 0, 0, kWidth, kHeight);
  frame.draw_plane(tilted, 0.9, 60, 40, 100, 80);
  return frame;
}

TEST(Organize, KeepsReadingsOfTheRegionWithinTheRange) {
  test::TestFrame frame(kWidth, kHeight, kFocal_px);
  for (int u = 0; u < kWidth; ++u) frame.at(u, 50) = static_cast<std::uint16_t>(900 + u);
  Steps steps;
  OrganizeParams params;
  params.roi_left_px = 10;
  params.roi_top_px = 40;
  params.roi_width_px = 100;
  params.roi_height_px = 20;
  params.min_z_m = 0.920;
  params.max_z_m = 0.950;
  const Result<std::size_t> kept = organize(frame.frame, params, steps.work);
  ASSERT_TRUE(kept.ok());
  EXPECT_EQ(kept.value(), 31U);
  EXPECT_EQ(steps.work.depth.width, 100);
  EXPECT_EQ(steps.work.depth.at(10, 10), 920);
  EXPECT_EQ(steps.work.depth.at(9, 10), 0);
  EXPECT_EQ(steps.work.label.at(40, 10), kForeground);
  EXPECT_EQ(steps.work.label.at(41, 10), kNoLabel);
  EXPECT_DOUBLE_EQ(steps.work.intrinsics.cx, frame.frame.intrinsics.cx - 10.0);
  EXPECT_DOUBLE_EQ(steps.work.intrinsics.cy, frame.frame.intrinsics.cy - 40.0);
}

TEST(Organize, RefusesARegionOutsideAndAFrameTooLarge) {
  Steps steps;
  test::TestFrame frame(kWidth, kHeight, kFocal_px);
  OrganizeParams outside;
  outside.roi_left_px = kWidth;
  EXPECT_EQ(organize(frame.frame, outside, steps.work).error().code, Code::RoiEmpty);
  test::TestFrame large(300, 200, kFocal_px);
  EXPECT_EQ(organize(large.frame, {}, steps.work).error().code, Code::CapacityExceeded);
  test::TestFrame tall(1, kMostRows + 1, kFocal_px);
  const Result<std::size_t> refused = organize(tall.frame, {}, steps.work);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, Code::CapacityExceeded);
  EXPECT_EQ(refused.error().detail, kMostRows + 1) << "its pixels alone would fit";
  EXPECT_EQ(organize(DepthFrame{}, {}, steps.work).error().code, Code::RoiEmpty);
}

TEST(DepthMedian, RemovesASpeckAndKeepsAStep) {
  test::TestFrame frame(kWidth, kHeight, kFocal_px);
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) frame.at(u, v) = u < 80 ? 1000 : 1300;
  }
  frame.at(40, 40) = 4000;
  frame.at(20, 20) = 0;
  Steps steps;
  ASSERT_TRUE(organize(frame.frame, {}, steps.work).ok());
  steps.median.apply(steps.work);
  EXPECT_EQ(steps.work.depth.at(40, 40), 1000);
  EXPECT_EQ(steps.work.depth.at(20, 20), 0) << "a gap is not filled";
  EXPECT_EQ(steps.work.depth.at(79, 60), 1000);
  EXPECT_EQ(steps.work.depth.at(80, 60), 1300);
  EXPECT_EQ(steps.work.depth.at(0, 0), 1000) << "the border uses the readings there are";
}

TEST(DepthMedian, ChangesNothingWhenOff) {
  test::TestFrame frame = table_with_block();
  frame.at(40, 40) = 4000;
  DepthMedianParams params;
  params.window = MedianWindow::Off;
  DepthMedian off(params);
  Steps steps;
  ASSERT_TRUE(organize(frame.frame, {}, steps.work).ok());
  off.apply(steps.work);
  EXPECT_EQ(steps.work.depth.at(40, 40), 4000);
}

TEST(DepthOutliers, RemoveFlyingPixelsBetweenTwoSurfaces) {
  test::TestFrame frame(kWidth, kHeight, kFocal_px);
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      frame.at(u, v) = u < 80 ? std::uint16_t{1000} : std::uint16_t{1500};
    }
    frame.at(80, v) = static_cast<std::uint16_t>(1100 + v);  // mixed pixels at the edge
  }
  Steps steps;
  ASSERT_TRUE(organize(frame.frame, {}, steps.work).ok());
  EXPECT_EQ(steps.outliers.apply(steps.work), static_cast<std::size_t>(kHeight));
  EXPECT_EQ(steps.work.depth.at(80, 60), 0);
  EXPECT_EQ(steps.work.label.at(80, 60), kNoLabel);
  EXPECT_EQ(steps.work.depth.at(79, 60), 1000);
  EXPECT_EQ(steps.work.depth.at(81, 60), 1500);
}

TEST(DepthOutliers, GiveAMixedPixelTheSurfaceThatMoreOfItsNeighboursLieOn) {
  test::TestFrame frame(kWidth, kHeight, kFocal_px);
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      frame.at(u, v) = u < 80 ? std::uint16_t{1000} : std::uint16_t{1500};
    }
  }
  frame.at(79, 30) = 1250;  // the near surface's last pixel
  frame.at(80, 60) = 1250;  // the far surface's first
  Steps steps;
  ASSERT_TRUE(organize(frame.frame, {}, steps.work).ok());
  EXPECT_EQ(steps.outliers.apply(steps.work), 0U);
  EXPECT_EQ(steps.work.depth.at(79, 30), 1000);
  EXPECT_EQ(steps.work.depth.at(80, 60), 1500);
  EXPECT_NE(steps.work.label.at(79, 30), kNoLabel);
}

TEST(DepthOutliers, RemoveALonePixelBeforeWhatIsNotRead) {
  test::TestFrame frame(kWidth, kHeight, kFocal_px);
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) frame.at(u, v) = 0;
  }
  frame.at(40, 40) = 1250;
  frame.at(41, 40) = frame.at(41, 41) = 1500;  // two readings are no surface
  Steps steps;
  ASSERT_TRUE(organize(frame.frame, {}, steps.work).ok());
  EXPECT_EQ(steps.outliers.apply(steps.work), 3U);
  EXPECT_EQ(steps.work.depth.at(40, 40), 0);
}

TEST(DepthOutliers, RemoveALonePixelBeforeASurface) {
  test::TestFrame frame(kWidth, kHeight, kFocal_px);
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) frame.at(u, v) = 1000;
  }
  // It mixes nothing: what it is nobody knows.
  frame.at(40, 40) = 700;
  frame.at(80, 40) = 1300;
  Steps steps;
  ASSERT_TRUE(organize(frame.frame, {}, steps.work).ok());
  EXPECT_EQ(steps.outliers.apply(steps.work), 2U);
  EXPECT_EQ(steps.work.depth.at(40, 40), 0);
  EXPECT_EQ(steps.work.depth.at(80, 40), 0);
}

TEST(Background, TaughtImageLeavesWhatStandsOnIt) {
  test::TestFrame empty(kWidth, kHeight, kFocal_px);
  empty.draw_plane(Vec3d(0.0, -0.3, -1.0).normalized(), 1.0, 0, 0, kWidth, kHeight);
  test::TestFrame frame = table_with_block();
  Steps steps;
  OrganizeParams params;
  params.roi_left_px = 20;
  params.roi_top_px = 10;
  ASSERT_TRUE(organize(frame.frame, params, steps.work).ok());
  BeltBackground belt;
  belt.depth = empty.frame.depth;
  Rng rng(1);
  const BackgroundReport report = steps.background.apply(steps.work, belt, 0.0, rng);
  EXPECT_EQ(report.used, BackgroundMethod::Image);
  EXPECT_EQ(report.foreground, 40U * 40U);
  EXPECT_EQ(steps.work.label.at(45, 45), kForeground);
  EXPECT_EQ(steps.work.label.at(5, 5), kNoLabel);
  EXPECT_NE(steps.work.depth.at(5, 5), 0) << "depth stays";
}

TEST(Background, TaughtPlaneLeavesWhatStandsOnIt) {
  test::TestFrame frame = table_with_block();
  Steps steps;
  OrganizeParams params;
  params.roi_top_px = 7;
  ASSERT_TRUE(organize(frame.frame, params, steps.work).ok());
  BeltBackground belt;
  belt.has_plane = true;
  belt.plane_normal = Vec3d(0.0, -0.3, -1.0).normalized();
  belt.plane_offset_m = 1.0;
  Rng rng(1);
  const BackgroundReport report = steps.background.apply(steps.work, belt, 0.0, rng);
  EXPECT_EQ(report.used, BackgroundMethod::Plane);
  EXPECT_EQ(report.foreground, 40U * 40U);
}

TEST(Background, FindsTheDominantPlaneOfTheFrame) {
  test::TestFrame frame = table_with_block();
  Steps steps;
  OrganizeParams params;
  params.roi_left_px = 5;
  ASSERT_TRUE(organize(frame.frame, params, steps.work).ok());
  Rng rng(1);
  const BackgroundReport report = steps.background.apply(steps.work, {}, 0.0, rng);
  EXPECT_EQ(report.used, BackgroundMethod::Dominant);
  ASSERT_GE(report.plane_count, 1U);
  // Depth is rounded to 1 mm over about 1 m of plane: the fit is far better than that.
  EXPECT_NEAR(report.planes[0].offset_m, 1.0, 0.001);
  EXPECT_LT((report.planes[0].normal - Vec3d(0.0, -0.3, -1.0).normalized()).norm(), 0.002);
}

TEST(Background, KeepsABlockWhosePlaneIsNotWideEnough) {
  test::TestFrame frame = table_with_block();
  Steps steps;
  ASSERT_TRUE(organize(frame.frame, {}, steps.work).ok());
  Rng rng(1);
  // The block is 40 px of 140 px focal length at 0.9 m: 0.26 m wide; the table is over 0.7 m.
  const BackgroundReport report = steps.background.apply(steps.work, {}, 0.4, rng);
  EXPECT_EQ(report.plane_count, 1U);
  EXPECT_EQ(report.foreground, 40U * 40U);
}

TEST(Background, FindsNoPlaneInScatteredReadings) {
  test::TestFrame frame(kWidth, kHeight, kFocal_px);
  Rng noise(3);
  for (std::uint16_t& count : frame.counts) {
    count = static_cast<std::uint16_t>(500 + noise.below(3000));
  }
  Steps steps;
  ASSERT_TRUE(organize(frame.frame, {}, steps.work).ok());
  Rng rng(1);
  const BackgroundReport report = steps.background.apply(steps.work, {}, 0.0, rng);
  EXPECT_EQ(report.used, BackgroundMethod::Off);
  EXPECT_EQ(report.removed, 0U);
}

TEST(Background, HandlesAFrameWithoutReadings) {
  test::TestFrame frame(kWidth, kHeight, kFocal_px);
  Steps steps;
  ASSERT_TRUE(organize(frame.frame, {}, steps.work).ok());
  steps.median.apply(steps.work);
  EXPECT_EQ(steps.outliers.apply(steps.work), 0U);
  Rng rng(1);
  EXPECT_EQ(steps.background.apply(steps.work, {}, 0.0, rng).foreground, 0U);
  Components components;
  steps.segmenter.apply(steps.work, components);
  EXPECT_TRUE(components.empty());
  test::OwnedSurface out(1000, 20000);
  EXPECT_EQ(decimate(steps.work, kForeground, {}, {}, 0.0, *out).error().code, Code::TooFewPoints);
}

TEST(DepthPlane, GivesTheDepthOfThePlaneOnEveryRay) {
  const Intrinsics k{640, 480, 525.0, 520.0, 310.0, 250.0};
  const Vec3d normal = Vec3d(0.2, -0.4, -0.9).normalized();
  const DepthPlane plane = depth_plane(normal, 0.8, k);
  for (const auto& [u, v] : {std::pair{0, 0}, {639, 0}, {100, 479}}) {
    const Vec3d ray((u - k.cx) / k.fx, (v - k.cy) / k.fy, 1.0);
    EXPECT_NEAR(plane.a * u + plane.b * v + plane.c, -normal.dot(ray) / 0.8, 1e-12);
  }
}

/// Two touching blocks at different depths, a thin bridge, a speck.
TEST(Segmenter, SplitsAtDepthJumpsAndJoinsWhatTouches) {
  test::TestFrame frame(kWidth, kHeight, kFocal_px);
  frame.draw_plane(kFacing, 1.0, 20, 20, 60, 60);
  frame.draw_plane(kFacing, 0.8, 60, 20, 90, 60);   // touches the first in the image only
  frame.draw_plane(kFacing, 1.0, 20, 60, 25, 100);  // joined with the first
  frame.draw_plane(kFacing, 1.2, 120, 110, 124, 114);
  Steps steps;
  ASSERT_TRUE(organize(frame.frame, {}, steps.work).ok());
  Components components;
  steps.segmenter.apply(steps.work, components);
  ASSERT_EQ(components.size(), 2U);
  EXPECT_EQ(components[0].pixels, 40U * 40U + 5U * 40U);
  EXPECT_EQ(components[1].pixels, 30U * 40U);
  EXPECT_NEAR(components[0].mean_depth_m, 1.0, 1e-9);
  // The second block's pixels are smaller: 0.64 of the area each.
  EXPECT_NEAR(components[1].area_m2, 1200.0 * 0.64 / (kFocal_px * kFocal_px), 1e-9);
  EXPECT_EQ(components[0].left, 20);
  EXPECT_EQ(components[0].right, 60);
  EXPECT_EQ(components[0].bottom, 100);
  EXPECT_FALSE(components[0].touches_edge);
  EXPECT_EQ(steps.work.label.at(22, 90), 1);
  EXPECT_EQ(steps.work.label.at(70, 30), 2);
  EXPECT_EQ(steps.work.label.at(121, 111), kForeground) << "too small for a component";
  EXPECT_EQ(steps.work.label.at(0, 0), kNoLabel);
}

TEST(Segmenter, SaysWhenAComponentIsCutByTheEdge) {
  test::TestFrame frame(kWidth, kHeight, kFocal_px);
  frame.draw_plane(kFacing, 1.0, 0, 20, 60, 60);
  frame.draw_plane(kFacing, 1.0, 80, 20, 110, 60);
  Steps steps;
  ASSERT_TRUE(organize(frame.frame, {}, steps.work).ok());
  Components components;
  steps.segmenter.apply(steps.work, components);
  ASSERT_EQ(components.size(), 2U);
  EXPECT_TRUE(components[0].touches_edge);
  EXPECT_FALSE(components[1].touches_edge);
}

TEST(Segmenter, JoinsARingAndASpiral) {
  test::TestFrame frame(kWidth, kHeight, kFocal_px);
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      const double r = std::hypot(u - 80.0, v - 60.0);
      const bool ring = std::fabs(r - 50.0) < 4.0;
      if (ring || r < 20.0) frame.at(u, v) = 1000;
    }
  }
  Steps steps;
  ASSERT_TRUE(organize(frame.frame, {}, steps.work).ok());
  Components components;
  steps.segmenter.apply(steps.work, components);
  EXPECT_EQ(components.size(), 2U);
}

TEST(Segmenter, KeepsTheLargestAndSaysSoWhenThereAreTooMany) {
  test::TestFrame frame(kWidth, kHeight, kFocal_px);
  std::size_t drawn = 0;
  for (int row = 0; row < 6; ++row) {
    for (int column = 0; column < 8; ++column, ++drawn) {
      const int size = 8 + static_cast<int>(drawn % 7);
      frame.draw_plane(kFacing, 1.0, 19 * column, 19 * row, 19 * column + size, 19 * row + size);
    }
  }
  SegmentParams params;
  params.min_pixels = 10;
  Steps steps({}, params);
  ASSERT_TRUE(organize(frame.frame, {}, steps.work).ok());
  Components components;
  steps.segmenter.apply(steps.work, components);
  EXPECT_EQ(components.size(), kMaxComponents);
  EXPECT_TRUE(components.overflowed());
  EXPECT_EQ(components[0].pixels, 14U * 14U);
  EXPECT_GE(components[kMaxComponents - 1].pixels, 9U * 9U);
}

TEST(Segmenter, SaysWhenTheRunsDoNotFit) {
  test::TestFrame frame(kWidth, kHeight, kFocal_px);
  for (int v = 0; v < kHeight; ++v) {
    for (int u = v % 2; u < kWidth; u += 2) frame.at(u, v) = 1000;
  }
  Steps steps;
  ASSERT_TRUE(organize(frame.frame, {}, steps.work).ok());
  Components components;
  steps.segmenter.apply(steps.work, components);
  EXPECT_TRUE(components.overflowed());
}

TEST(Decimate, PutsPointsOnTheirRaysAndKeepsTheGrid) {
  test::TestFrame frame = table_with_block();
  Steps steps;
  ASSERT_TRUE(organize(frame.frame, {}, steps.work).ok());
  test::OwnedSurface out(8000, 20000);
  const Result<int> stride = decimate(steps.work, kForeground, {}, {}, 0.02, *out);
  ASSERT_TRUE(stride.ok());
  // Pitch z/f: about 1 m / 140 px = 7 mm, so 2 cm are three pixels.
  EXPECT_EQ(stride.value(), 3);
  EXPECT_NEAR(out->spacing_m, 0.02, 0.004);
  EXPECT_TRUE(out->has_viewpoint);
  const Intrinsics& k = out->grid.intrinsics;
  const Vec3d tilted = Vec3d(0.0, -0.3, -1.0).normalized();
  for (std::size_t i = 0; i < out->size; ++i) {
    const int pixel = out->grid.pixel_of[i];
    ASSERT_EQ(out->grid.point_of[static_cast<std::size_t>(pixel)], static_cast<int>(i));
    const Vec3d p = out->point(i).cast<double>();
    // Within half a grid pixel of the pixel's centre.
    ASSERT_LE(std::fabs(k.fx * p.x() / p.z() + k.cx - pixel % out->grid.width), 0.5);
    ASSERT_LE(std::fabs(k.fy * p.y() / p.z() + k.cy - pixel / out->grid.width), 0.5);
    const double height = tilted.dot(p) + 1.0;
    // On the table or on the block, within the rounding of depth to 1 mm and the slope in a block.
    ASSERT_LT(std::min(std::fabs(height), std::fabs(height - 0.1)), 0.0015);
  }
}

TEST(Decimate, TakesOneComponentAndItsBoxOnly) {
  test::TestFrame frame(kWidth, kHeight, kFocal_px);
  frame.draw_plane(kFacing, 1.0, 20, 20, 60, 60);
  frame.draw_plane(kFacing, 0.8, 80, 30, 110, 60);
  Steps steps;
  ASSERT_TRUE(organize(frame.frame, {}, steps.work).ok());
  Components components;
  steps.segmenter.apply(steps.work, components);
  ASSERT_EQ(components.size(), 2U);
  test::OwnedSurface out(8000, 20000);
  DecimateParams params;
  ASSERT_TRUE(decimate(steps.work, 2, {}, params, 0.001, *out).ok());
  EXPECT_EQ(out->grid.width, 30);
  EXPECT_EQ(out->grid.height, 30);
  EXPECT_EQ(out->size, 900U);
  EXPECT_FLOAT_EQ(out->z[0], 0.8F);
  EXPECT_NEAR(out->x[0], (80 - frame.frame.intrinsics.cx) * 0.8 / kFocal_px, 1e-6);
}

TEST(Decimate, GrowsTheStrideUntilThePointsFit) {
  test::TestFrame frame = table_with_block();
  Steps steps;
  ASSERT_TRUE(organize(frame.frame, {}, steps.work).ok());
  test::OwnedSurface out(500, 20000);
  const Result<int> stride = decimate(steps.work, kForeground, {}, {}, 0.001, *out);
  ASSERT_TRUE(stride.ok());
  EXPECT_LE(out->size, 500U);
  EXPECT_EQ(stride.value(), 7) << "160 x 120 pixels in blocks of 7: 23 x 18 = 414 points";
}

TEST(Decimate, DoesNotMixTwoSurfacesInOneBlock) {
  test::TestFrame frame(kWidth, kHeight, kFocal_px);
  frame.draw_plane(kFacing, 1.0, 0, 0, 82, kHeight);
  frame.draw_plane(kFacing, 1.5, 82, 0, kWidth, kHeight);
  Steps steps;
  ASSERT_TRUE(organize(frame.frame, {}, steps.work).ok());
  test::OwnedSurface out(8000, 20000);
  ASSERT_TRUE(decimate(steps.work, kForeground, {}, {}, 0.04, *out).ok());
  for (std::size_t i = 0; i < out->size; ++i) {
    ASSERT_TRUE(out->z[i] == 1.0F || out->z[i] == 1.5F) << out->z[i];
  }
}

TEST(Decimate, CarriesTheColourAsIntensity) {
  test::TestFrame frame(kWidth, kHeight, kFocal_px);
  frame.draw_plane(kFacing, 1.0, 0, 0, kWidth, kHeight);
  std::vector<Rgb8> color(frame.counts.size(), Rgb8{255, 255, 255});
  Steps steps;
  ASSERT_TRUE(organize(frame.frame, {}, steps.work).ok());
  test::OwnedSurface out(8000, 20000);
  const ImageView<const Rgb8> view(color.data(), kWidth, kHeight);
  ASSERT_TRUE(decimate(steps.work, kForeground, view, {}, 0.05, *out).ok());
  EXPECT_NEAR(out->intensity[0], 1.0, 1e-6);
}

TEST(DepthSteps, UseExactlyTheMeasuredMemory) {
  const Steps steps;
  EXPECT_EQ(steps.memory.measured_bytes(), steps.memory.used_bytes());
}

}  // namespace
}  // namespace grapnel
