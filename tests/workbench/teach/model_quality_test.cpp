#include "workbench/teach/model_quality.h"

#include <gtest/gtest.h>

#include <cmath>

namespace grapnel {
namespace {

constexpr double kSpacing_m = 0.003;

/// Points of a sphere of 10 cm with outward normals, those whose z is at most `highest_m`.
CloudData sphere(double highest_m) {
  constexpr double kRadius_m = 0.1;
  constexpr int kPoints = 20000;  // 2.5 mm apart
  CloudData cloud;
  for (int i = 0; i < kPoints; ++i) {
    const double z = 1.0 - (2.0 * i + 1.0) / kPoints;
    if (kRadius_m * z > highest_m) continue;
    const double r = std::sqrt(1.0 - z * z);
    const Vec3d n(r * std::cos(2.399963 * i), r * std::sin(2.399963 * i), z);
    const Vec3f p = (kRadius_m * n).cast<float>();
    cloud.x.push_back(p.x());
    cloud.y.push_back(p.y());
    cloud.z.push_back(p.z());
    cloud.nx.push_back(static_cast<float>(n.x()));
    cloud.ny.push_back(static_cast<float>(n.y()));
    cloud.nz.push_back(static_cast<float>(n.z()));
  }
  cloud.width = static_cast<int>(cloud.size());
  return cloud;
}

TEST(ModelQuality, CountsTheCapsAroundTheCameras) {
  std::vector<Vec3d> cameras;
  for (const ModelSide& side : model_sides()) cameras.push_back(0.5 * side.toward_viewer);
  const ModelQuality quality = measure_quality(sphere(1.0), kSpacing_m, cameras);
  // Six separate caps of 30 degrees, of 500 directions.
  EXPECT_NEAR(quality.view_sphere_coverage, 6.0 * 0.5 * (1.0 - std::cos(0.5235988)), 0.02);
}

TEST(ModelQuality, FindsAClosedSurfaceClosedFromEverywhere) {
  const ModelQuality quality = measure_quality(sphere(1.0), kSpacing_m, {});
  // At the outline itself the discs of the far half may win.
  EXPECT_LT(quality.open_share, 0.03);
  EXPECT_EQ(quality.view_sphere_coverage, 0.0);
}

TEST(ModelQuality, SeesIntoABowlFromItsOpenSideOnly) {
  const ModelQuality quality = measure_quality(sphere(0.0), kSpacing_m, {});
  for (std::size_t i = 0; i < quality.side_open_share.size(); ++i) {
    const std::string_view side = model_sides()[i].name;
    if (side == "+z") {
      EXPECT_GT(quality.side_open_share[i], 0.95);
    } else {
      EXPECT_LT(quality.side_open_share[i], 0.05) << side;
    }
  }
}

TEST(ModelQuality, PutsTheFirstCamerasViewUprightIntoTheSheetsFirstPlace) {
  // A point right of and above the middle one, as a camera sees it: x right, y down.
  CloudData cloud;
  cloud.x = {-0.1F, 0.1F, 0.0F};
  cloud.y = {0.1F, -0.1F, 0.0F};
  cloud.z = {0.5F, 0.5F, 0.5F};
  cloud.nx = cloud.ny = {0.0F, 0.0F, 0.0F};
  cloud.nz = {-1.0F, -1.0F, -1.0F};
  const ModelPicture sheet = draw_sides(cloud, 0.01, 90);
  ASSERT_EQ(sheet.width, 270);
  ASSERT_EQ(sheet.height, 180);
  const auto dark = [&](int u, int v) {
    return sheet.pixels[static_cast<std::size_t>(v * sheet.width + u)].r < 255;
  };
  // The ball's radius is 0.1414 m, a pixel 3.3 mm: 0.1 m are 30.3 pixels from 44.5.
  EXPECT_TRUE(dark(75, 14));
  EXPECT_TRUE(dark(14, 75));
  EXPECT_FALSE(dark(75, 75));
  EXPECT_FALSE(dark(14, 14));
}

}  // namespace
}  // namespace grapnel
