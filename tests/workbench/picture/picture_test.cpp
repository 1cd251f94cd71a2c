#include <gtest/gtest.h>

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "workbench/picture/point_render.h"
#include "workbench/picture/rgb_image.h"
#include "workbench/picture/scene_picture.h"

namespace grapnel {
namespace {

constexpr Intrinsics kCamera = {80, 60, 100.0, 100.0, 39.5, 29.5};
constexpr double kPlate_m = 1.0;  // the plate's depth
constexpr int kPanel_px = 80;

std::string base64_of(std::string_view text) { return base64(std::as_bytes(std::span(text))); }

// The test vectors of RFC 4648, section 10.
TEST(Base64, WritesTheStandardsOwnExamples) {
  EXPECT_EQ(base64_of(""), "");
  EXPECT_EQ(base64_of("f"), "Zg==");
  EXPECT_EQ(base64_of("fo"), "Zm8=");
  EXPECT_EQ(base64_of("foo"), "Zm9v");
  EXPECT_EQ(base64_of("foobar"), "Zm9vYmFy");
}

/// A square plate of 0.2 m that faces the camera, a point every 5 mm.
struct Plate {
  std::vector<float> x, y, z, nx, ny, nz;

  Plate() {
    for (int i = -20; i <= 20; ++i) {
      for (int j = -20; j <= 20; ++j) {
        x.push_back(0.005F * static_cast<float>(i));
        y.push_back(0.005F * static_cast<float>(j));
        z.push_back(0.0F);
      }
    }
    nx.assign(x.size(), 0.0F);
    ny = nx;
    nz.assign(x.size(), -1.0F);
  }
  [[nodiscard]] PlacedPoints at(double depth_m) const {
    PlacedPoints placed{x, y, z, nx, ny, nz, 0.005, Pose::Identity()};
    placed.camera_from_points.translation().z() = depth_m;
    return placed;
  }
};

TEST(PointRender, GivesThePlaneItsDepthAndItsSize) {
  PointRender render(kCamera);
  render.add(Plate().at(kPlate_m));
  int covered = 0;
  for (int v = 0; v < kCamera.height; ++v) {
    for (int u = 0; u < kCamera.width; ++u) {
      if (!(render.z_m(u, v) > 0.0F)) continue;
      ++covered;
      EXPECT_NEAR(render.z_m(u, v), kPlate_m, 1e-5);
    }
  }
  // 0.2 m at 1 m and 100 px are 20 px; a disc may reach one beyond on each side.
  EXPECT_GE(covered, 20 * 20);
  EXPECT_LE(covered, 23 * 23);
}

TEST(PointRender, HidesWhatTurnsItsBackOnTheCamera) {
  Plate plate;
  plate.nz.assign(plate.nz.size(), 1.0F);
  PointRender render(kCamera);
  render.add(plate.at(kPlate_m));
  EXPECT_TRUE(render.empty());
}

/// A frame that measures `counts` millimetres everywhere.
struct Wall {
  explicit Wall(std::uint16_t counts)
      : depth(static_cast<std::size_t>(kCamera.width * kCamera.height), counts) {
    frame.depth = {depth.data(), kCamera.width, kCamera.height};
    frame.intrinsics = kCamera;
  }
  Wall(const Wall&) = delete;
  Wall& operator=(const Wall&) = delete;
  std::vector<std::uint16_t> depth;
  DepthFrame frame;
};

/// The sample panel's colour at the plate's middle when the camera measured `counts` millimetres.
Rgb8 sample_color(std::uint16_t counts) {
  const Plate plate;
  const Wall wall(counts);
  PictureParams params;
  params.panel_px = kPanel_px;
  params.whole_image = true;
  const PlacedPoints found = plate.at(kPlate_m);
  const RgbImage image = draw_scene(wall.frame, {&found, 1}, {}, params);
  // The third of three panels of the image's own size, 4 px between.
  return image.at(2 * (kCamera.width + 4) + 40, 30);
}

bool nearest(const Rgb8& color, const Rgb8& wanted) {
  const auto distance = [&](const Rgb8& other) {
    const int r = color.r - other.r;
    const int g = color.g - other.g;
    const int b = color.b - other.b;
    return r * r + g * g + b * b;
  };
  for (const Rgb8& other : {kMatchedColor, kContradictedColor, kOccludedColor, kUnknownColor}) {
    if (distance(other) < distance(wanted)) return false;
  }
  return true;
}

TEST(ScenePicture, ColoursSamplesByWhatWasMeasured) {
  EXPECT_TRUE(nearest(sample_color(1000), kMatchedColor));
  EXPECT_TRUE(nearest(sample_color(1020), kContradictedColor));  // seen through
  EXPECT_TRUE(nearest(sample_color(980), kOccludedColor));
  EXPECT_TRUE(nearest(sample_color(0), kUnknownColor));
}

TEST(ScenePicture, DrawsArrowsOnTheSecondPanel) {
  const Wall wall(1000);
  PictureParams params;
  params.panel_px = kPanel_px;
  params.whole_image = true;
  // Along a row of the image, from column 20 to 60, a metre away.
  const auto at = [](double u, double v) {
    return Vec3d((u - kCamera.cx) / kCamera.fx, (v - kCamera.cy) / kCamera.fy, 1.0);
  };
  const DrawnArrow arrow{at(20.5, 30.5), at(60.5, 30.5), kRivalColor};
  const DrawnArrow behind{-arrow.from, -arrow.to, kTruthColor};
  const std::array arrows = {arrow, behind};
  const RgbImage image = draw_scene(wall.frame, {}, {}, params, arrows);
  const int second = kCamera.width + 4;
  EXPECT_EQ(image.at(second + 40, 30), kRivalColor);
  EXPECT_NE(image.at(second + 40, 33), kRivalColor);
  EXPECT_EQ(image.at(second + 60, 32), kRivalColor);  // its head is broader
  EXPECT_NE(image.at(40, 30), kRivalColor);           // the first panel stays
  for (int u = second; u < image.width(); ++u) EXPECT_NE(image.at(u, 30), kTruthColor);
}

TEST(ScenePicture, WithoutAPoseShowsTheWholeImageTwice) {
  const Wall wall(1000);
  PictureParams params;
  params.panel_px = kPanel_px;
  const RgbImage image = draw_scene(wall.frame, {}, {}, params);
  EXPECT_EQ(image.width(), 2 * kCamera.width + 4);
  EXPECT_EQ(image.height(), kCamera.height);
}

}  // namespace
}  // namespace grapnel
