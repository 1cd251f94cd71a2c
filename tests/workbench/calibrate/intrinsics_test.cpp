// Boards drawn through a known camera: every pixel's ray, bent by the lens, meets the board or not.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "base/file.h"
#include "base/input_error.h"
#include "base/rng.h"
#include "drivers/replay/camera_file.h"
#include "drivers/replay/image_file.h"
#include "tests/support/temp_folder.h"
#include "workbench/calibrate/chessboard.h"
#include "workbench/calibrate/zhang.h"
#include "workbench/commands.h"

namespace grapnel {
namespace {

constexpr int kWidth = 320;
constexpr int kHeight = 240;
constexpr int kColumns = 7;
constexpr int kRows = 5;
constexpr double kSquare_m = 0.03;

struct Truth {
  double fx = 290.0, fy = 288.0, cx = 162.5, cy = 117.3;
  double k1 = -0.12, k2 = 0.05;
};

struct View {
  Pose camera_from_board = Pose::Identity();
};

Eigen::Vector2d project(const Truth& t, const Vec3d& p) {
  const double x = p.x() / p.z();
  const double y = p.y() / p.z();
  const double r2 = x * x + y * y;
  const double radial = 1.0 + t.k1 * r2 + t.k2 * r2 * r2;
  return {t.fx * x * radial + t.cx, t.fy * y * radial + t.cy};
}

/// The ray of a pixel: the lens is undone by iteration.
Vec3d ray(const Truth& t, double u, double v) {
  const double xd = (u - t.cx) / t.fx;
  const double yd = (v - t.cy) / t.fy;
  double x = xd;
  double y = yd;
  for (int i = 0; i < 8; ++i) {
    const double r2 = x * x + y * y;
    const double radial = 1.0 + t.k1 * r2 + t.k2 * r2 * r2;
    x = xd / radial;
    y = yd / radial;
  }
  return {x, y, 1.0};
}

/// Dark squares on a white sheet on a grey table.
double shade(double x, double y) {
  const double column = std::floor(x / kSquare_m + 1.0);
  const double row = std::floor(y / kSquare_m + 1.0);
  const bool sheet = column >= -1.0 && column <= kColumns + 1 && row >= -1.0 && row <= kRows + 1;
  if (!sheet) return 90.0;
  const bool board = column >= 0.0 && column <= kColumns && row >= 0.0 && row <= kRows;
  const bool dark = board && static_cast<int>(column + row) % 2 == 0;
  return dark ? 30.0 : 220.0;
}

constexpr int kSamples = 6;  // of a pixel, each way

GrayImage draw(const Truth& t, const View& view, std::uint64_t seed) {
  GrayImage image;
  image.width = kWidth;
  image.height = kHeight;
  Rng rng(seed);
  const Pose board_from_camera = view.camera_from_board.inverse();
  const Vec3d origin = board_from_camera.translation();
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      double sum = 0.0;
      for (int i = 0; i < kSamples * kSamples; ++i) {
        const double du = (i % kSamples + 0.5) / kSamples - 0.5;
        const double dv = (i / kSamples + 0.5) / kSamples - 0.5;
        const Vec3d direction = board_from_camera.linear() * ray(t, u + du, v + dv);
        const double reach = -origin.z() / direction.z();
        sum += shade(origin.x() + reach * direction.x(), origin.y() + reach * direction.y());
      }
      image.pixels.push_back(static_cast<float>(sum / (kSamples * kSamples) + 2.0 * rng.normal()));
    }
  }
  return image;
}

/// A board tilted about an axis in its own plane, its centre before the camera.
View view_of(double tilt_rad, double about_rad, double distance_m, double x_m, double y_m) {
  View view;
  const Vec3d axis(std::cos(about_rad), std::sin(about_rad), 0.0);
  const Vec3d middle(0.5 * (kColumns - 1) * kSquare_m, 0.5 * (kRows - 1) * kSquare_m, 0.0);
  view.camera_from_board = Eigen::Translation3d(x_m, y_m, distance_m) *
                           Eigen::AngleAxisd(tilt_rad, axis) * Eigen::Translation3d(-middle);
  return view;
}

std::vector<View> views() {
  return {view_of(0.0, 0.0, 0.36, 0.0, 0.0),     view_of(0.5, 0.0, 0.36, 0.04, 0.03),
          view_of(0.5, 1.6, 0.36, -0.05, 0.03),  view_of(-0.5, 0.0, 0.40, -0.05, -0.04),
          view_of(-0.5, 1.6, 0.38, 0.06, -0.03), view_of(0.4, 0.8, 0.33, 0.0, 0.02),
          view_of(0.4, 2.4, 0.42, -0.08, 0.05),  view_of(-0.6, 0.8, 0.45, 0.09, 0.06)};
}

TEST(Chessboard, CornersAreFoundToATenthOfAPixelInOrder) {
  const Truth truth;
  int index = 0;
  for (const View& view : views()) {
    const auto corners =
        find_chessboard(draw(truth, view, static_cast<std::uint64_t>(++index)), kColumns, kRows);
    ASSERT_TRUE(corners.has_value()) << "view " << index;
    double square = 0.0;
    double turned_square = 0.0;
    for (int i = 0; i < kColumns * kRows; ++i) {
      const Vec3d on_board(i % kColumns * kSquare_m, i / kColumns * kSquare_m, 0.0);
      const Eigen::Vector2d seen = project(truth, view.camera_from_board * on_board);
      square += ((*corners)[static_cast<std::size_t>(i)] - seen).squaredNorm();
      const int other = kColumns * kRows - 1 - i;
      turned_square += ((*corners)[static_cast<std::size_t>(other)] - seen).squaredNorm();
    }
    const double rms = std::sqrt(std::min(square, turned_square) / (kColumns * kRows));
    EXPECT_LT(rms, 0.1) << "view " << index;
  }
}

TEST(Chessboard, IsNotFoundWhereAHandHidesACornerOrTheSizeIsAnother) {
  GrayImage image = draw({}, views()[0], 1);
  EXPECT_FALSE(find_chessboard(image, kColumns + 1, kRows).has_value());
  for (int v = 110; v < 135; ++v) {
    for (int u = 150; u < 180; ++u) image.pixels[static_cast<std::size_t>(v * kWidth + u)] = 120.0F;
  }
  EXPECT_FALSE(find_chessboard(image, kColumns, kRows).has_value());
  std::fill(image.pixels.begin(), image.pixels.end(), 80.0F);
  EXPECT_FALSE(find_chessboard(image, kColumns, kRows).has_value());
}

TEST(CameraFit, FindsAKnownCameraFromDrawnBoards) {
  const Truth truth;
  std::vector<BoardView> boards;
  std::uint64_t seed = 1;
  for (const View& view : views()) {
    const auto corners = find_chessboard(draw(truth, view, seed++), kColumns, kRows);
    ASSERT_TRUE(corners.has_value());
    boards.push_back({*corners});
  }
  const CameraFit fit = fit_camera(boards, kColumns, kRows, kSquare_m, kWidth, kHeight);
  // Half a percent of the focal length and a pixel are what eight views of corners to a tenth of a
  // pixel give at this size.
  EXPECT_NEAR(fit.intrinsics.fx, truth.fx, 1.5);
  EXPECT_NEAR(fit.intrinsics.fy, truth.fy, 1.5);
  EXPECT_NEAR(fit.intrinsics.cx, truth.cx, 1.0);
  EXPECT_NEAR(fit.intrinsics.cy, truth.cy, 1.0);
  EXPECT_NEAR(fit.distortion[0], truth.k1, 0.03);
  EXPECT_LT(fit.rms_px, 0.15);
  for (const double sigma_px : fit.sigma_px) EXPECT_LT(sigma_px, 1.5);
}

TEST(CameraFit, IsExactWithoutNoise) {
  const Truth truth;
  std::vector<BoardView> boards;
  for (const View& view : views()) {
    BoardView board;
    for (int i = 0; i < kColumns * kRows; ++i) {
      const Vec3d on_board(i % kColumns * kSquare_m, i / kColumns * kSquare_m, 0.0);
      board.corners_px.push_back(project(truth, view.camera_from_board * on_board));
    }
    boards.push_back(board);
  }
  const CameraFit fit = fit_camera(boards, kColumns, kRows, kSquare_m, kWidth, kHeight);
  EXPECT_NEAR(fit.intrinsics.fx, truth.fx, 1e-4);
  EXPECT_NEAR(fit.intrinsics.cy, truth.cy, 1e-4);
  EXPECT_NEAR(fit.distortion[0], truth.k1, 1e-6);
  EXPECT_NEAR(fit.distortion[1], truth.k2, 1e-5);
  EXPECT_NEAR(fit.distortion[2], 0.0, 1e-6);
}

TEST(CameraFit, NeedsThreeViewsFromSeveralDirections) {
  std::vector<BoardView> boards(2);
  EXPECT_THROW((void)fit_camera(boards, kColumns, kRows, kSquare_m, kWidth, kHeight), InputError);
}

TEST(CalibrateIntrinsics, WritesTheCameraThatDrewThePictures) {
  const test::TempFolder folder;
  const Truth truth;
  std::vector<std::string> args = {"calibrate", "intrinsics"};
  std::uint64_t seed = 1;
  for (const View& view : views()) {
    const GrayImage image = draw(truth, view, seed++);
    std::vector<Rgb8> pixels;
    for (const float value : image.pixels) {
      const auto gray = static_cast<std::uint8_t>(std::clamp(std::lround(value), 0L, 255L));
      pixels.push_back({gray, gray, gray});
    }
    const std::string file = (folder / ("board" + std::to_string(seed) + ".png")).string();
    write_file(file, encode_color_png({pixels.data(), kWidth, kHeight}));
    args.push_back(file);
  }
  const std::string camera = (folder / "UNIT7.toml").string();
  args.insert(args.end(), {"--board", "7x5", "--square", "0.03", "--serial", "UNIT7", "--ir-shift",
                           "-4,-3", "-o", camera});
  ASSERT_EQ(run_grapnel(args), 0);
  const CameraFile file = read_camera_file(camera);
  EXPECT_EQ(file.serial, "UNIT7");
  // As of the corners themselves, see above; eight bits of grey are finer than the noise.
  EXPECT_NEAR(file.fx, truth.fx, 1.5);
  EXPECT_NEAR(file.fy, truth.fy, 1.5);
  EXPECT_NEAR(file.cx, truth.cx, 1.0);
  EXPECT_NEAR(file.cy, truth.cy, 1.0);
  // Infrared pixel (u - 4, v - 3) is depth pixel (u, v).
  EXPECT_NEAR(file.intrinsics().cx, truth.cx + 4.0, 1.0);
  EXPECT_NEAR(file.intrinsics().cy, truth.cy + 3.0, 1.0);
  // What the numbers are for: a ray through the lens, in the image's corner, to a pixel.
  const Vec3d edge = ray(truth, 5.0, 5.0);
  Truth fitted;
  fitted.fx = file.fx;
  fitted.fy = file.fy;
  fitted.cx = file.cx;
  fitted.cy = file.cy;
  fitted.k1 = file.distortion[0];
  fitted.k2 = file.distortion[1];
  EXPECT_LT((project(fitted, edge) - Eigen::Vector2d(5.0, 5.0)).norm(), 1.0);
}

}  // namespace
}  // namespace grapnel
