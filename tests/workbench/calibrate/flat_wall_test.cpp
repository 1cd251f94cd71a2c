#include "workbench/calibrate/flat_wall.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "base/input_error.h"
#include "base/rng.h"
#include "drivers/replay/depth_correction.h"
#include "drivers/replay/recording_writer.h"
#include "tests/support/temp_folder.h"

namespace grapnel {
namespace {

constexpr int kWidth = 320;
constexpr int kHeight = 240;
// The sensor's errors: its disparity is 1/z = (1/z_true - kOffset) / kScale, and its depth is bowed
// outward by 2 % at the image's corners at 1 m, in proportion to the distance.
constexpr double kOffset = 0.02;
constexpr double kScale = 0.97;
constexpr double kBow = 0.02;

CameraFile camera() {
  CameraFile file;
  file.width = kWidth;
  file.height = kHeight;
  file.fx = file.fy = 287.5;
  file.cx = 159.5;
  file.cy = 119.5;
  file.metres_per_unit = 0.0002;
  file.serial = "UNIT7";
  return file;
}

double wall_z(double distance_m, double slope_x, double slope_y, int u, int v) {
  const double x = (u - 159.5) / 287.5;
  const double y = (v - 119.5) / 287.5;
  // z = distance + slope_x X + slope_y Y with X = x z.
  return distance_m / (1.0 - slope_x * x - slope_y * y);
}

double measured(double z, int u, int v) {
  const double disparity = (1.0 / z - kOffset) / kScale;
  const double r2 = ((u - 159.5) * (u - 159.5) + (v - 119.5) * (v - 119.5)) / (200.0 * 200.0);
  return 1.0 / disparity * (1.0 + kBow * r2 * z);
}

WallView wall(double distance_m, double slope_x, double slope_y, std::uint64_t seed) {
  WallView view;
  view.name = "wall";
  view.width = kWidth;
  view.height = kHeight;
  view.distance_m = distance_m;
  Rng rng(seed);
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      const double z = wall_z(distance_m, slope_x, slope_y, u, v);
      // Khoshelham and Elberink 2012: 1.6 mm z² of one frame; the mean of 60.
      const double noise_m = 1.6e-3 * z * z / std::sqrt(60.0) * rng.normal();
      view.z_m.push_back(rng.below(50) == 0 ? 0.0 : measured(z, u, v) + noise_m);
    }
  }
  return view;
}

std::vector<WallView> three_walls() {
  return {wall(0.8, 0.1, -0.05, 1), wall(1.2, -0.2, 0.1, 2), wall(1.8, 0.05, 0.3, 3)};
}

/// Root mean square of corrected minus true depth on a wall that was not calibrated with.
double error_m(const CameraFile& file, double distance_m) {
  const DepthCorrection correction(file, file.metres_per_unit);
  std::vector<std::uint16_t> depth;
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      const double z = measured(wall_z(distance_m, -0.1, 0.2, u, v), u, v);
      depth.push_back(static_cast<std::uint16_t>(std::lround(z / file.metres_per_unit)));
    }
  }
  std::vector<float> scratch(correction.scratch_floats());
  correction.apply(depth, scratch);
  double square = 0.0;
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      const double z = depth[static_cast<std::size_t>(v * kWidth + u)] * file.metres_per_unit;
      const double off = z - wall_z(distance_m, -0.1, 0.2, u, v);
      square += off * off;
    }
  }
  return std::sqrt(square / (kWidth * kHeight));
}

TEST(CalibrateDepth, BringsADistortedSensorBackToTheTruthOnWallsItHasNotSeen) {
  CameraFile file = camera();
  EXPECT_GT(error_m(file, 1.0), 0.005);
  EXPECT_GT(error_m(file, 1.5), 0.015);
  const std::vector<WallReport> reports = calibrate_depth(three_walls(), {16, 12}, file);
  // The grid is linear between its distances where the bow is too, and the law is exact: what is
  // left are the walls' tilts, which the bow falsifies.
  EXPECT_LT(error_m(file, 1.0), 0.0015);
  EXPECT_LT(error_m(file, 1.5), 0.0025);
  ASSERT_EQ(reports.size(), 3U);
  for (const WallReport& report : reports) {
    EXPECT_LT(report.rms_after_m, 0.3 * report.rms_before_m);
    EXPECT_GT(report.plane_share, 0.95);
  }
  EXPECT_NEAR(reports[1].corrected_axis_m, 1.2, 0.002);
}

TEST(CalibrateDepth, ThatIsWrittenReadsBackTheSame) {
  CameraFile file = camera();
  (void)calibrate_depth(three_walls(), {16, 12}, file);
  const CameraFile read = parse_camera_file(parse_config(camera_file_text(file), "camera.toml"));
  EXPECT_EQ(read.serial, "UNIT7");
  // Six digits: a micrometre at a metre.
  const auto same = [](const std::vector<double>& a, const std::vector<double>& b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                      [](double x, double y) { return std::abs(x - y) < 1e-5; });
  };
  EXPECT_TRUE(same(read.disparity_law, file.disparity_law));
  EXPECT_TRUE(same(read.grid_multipliers, file.grid_multipliers));
  EXPECT_TRUE(same(read.grid_distances_m, file.grid_distances_m));
  EXPECT_EQ(read.grid_multipliers.size(), 3U * 16U * 12U);
}

TEST(CalibrateDepth, OneDistanceSetsTheScaleAndNoneLeavesItAlone) {
  CameraFile file = camera();
  (void)calibrate_depth({wall(1.2, 0.0, 0.0, 1)}, {8, 6}, file);
  ASSERT_EQ(file.disparity_law.size(), 2U);
  EXPECT_EQ(file.disparity_law[0], 0.0);
  WallView unmeasured = wall(1.2, 0.0, 0.0, 1);
  unmeasured.distance_m.reset();
  (void)calibrate_depth({unmeasured}, {8, 6}, file);
  EXPECT_TRUE(file.disparity_law.empty());
  EXPECT_EQ(file.grid_multipliers.size(), 48U);
}

TEST(CalibrateDepth, APersonBeforeTheWallIsLeftOut) {
  std::vector<WallView> walls = three_walls();
  for (int v = 100; v < 240; ++v) {
    for (int u = 40; u < 120; ++u) walls[1].z_m[static_cast<std::size_t>(v * kWidth + u)] = 0.7;
  }
  CameraFile file = camera();
  const std::vector<WallReport> reports = calibrate_depth(walls, {16, 12}, file);
  EXPECT_NEAR(reports[1].plane_share, 1.0 - 140.0 * 80.0 / (kWidth * kHeight), 0.01);
  EXPECT_LT(error_m(file, 1.0), 0.003);
}

TEST(CalibrateDepth, WhatIsNoWallIsRefused) {
  CameraFile file = camera();
  WallView room = wall(1.2, 0.0, 0.0, 1);
  for (std::size_t i = 0; i < room.z_m.size(); ++i)
    room.z_m[i] = 1.0 + 0.3 * static_cast<double>((i / 40) % 5);
  EXPECT_THROW((void)calibrate_depth({room}, {8, 6}, file), InputError);
  WallView dark = wall(1.2, 0.0, 0.0, 1);
  for (std::size_t i = 0; i < dark.z_m.size(); ++i) dark.z_m[i] *= i % 3 == 0 ? 1.0 : 0.0;
  EXPECT_THROW((void)calibrate_depth({dark}, {8, 6}, file), InputError);
  EXPECT_THROW(
      (void)calibrate_depth({wall(1.2, 0.0, 0.0, 1), wall(1.21, 0.0, 0.0, 2)}, {8, 6}, file),
      InputError)
      << "two walls at one distance";
}

TEST(ReadWall, IsTheMeanOfTheFramesWithTheDistanceFromItsName) {
  const test::TempFolder folder;
  RecordingWriter writer(folder / "wall", camera());
  std::vector<std::uint16_t> depth(static_cast<std::size_t>(kWidth * kHeight), 5000);
  for (const std::uint16_t first : {std::uint16_t{5000}, std::uint16_t{5002}, std::uint16_t{0}}) {
    depth[0] = first;
    depth[1] = first == 5000 ? std::uint16_t{5000} : std::uint16_t{0};
    writer.add_depth(first, {depth.data(), kWidth, kHeight});
  }
  CameraFile file;
  const WallView view = read_wall((folder / "wall").string() + "=1.02", 60, file);
  EXPECT_EQ(view.distance_m, 1.02);
  EXPECT_NEAR(view.z_m[0], 5001 * 0.0002, 1e-12);
  EXPECT_EQ(view.z_m[1], 0.0) << "a reading in one of three frames is none";
  EXPECT_EQ(file.serial, "UNIT7");
  EXPECT_THROW((void)read_wall((folder / "wall").string() + "=far", 60, file), InputError);
}

}  // namespace
}  // namespace grapnel
