#include "pipeline/view_grid.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/pipeline/support/surfaces.h"

namespace grapnel {
namespace {

constexpr int kWidth = 120;
constexpr int kHeight = 90;
constexpr std::size_t kPixels = static_cast<std::size_t>(kWidth) * kHeight;
const Vec3d kTilted = Vec3d(0.3, -0.2, -1.0).normalized();

Limits limits() {
  Limits limits = test::small_limits();
  limits.max_width = kWidth;
  limits.max_height = kHeight;
  return limits;
}

/// A camera's view: a tilted plane on the left, one that faces the camera half a metre behind on
/// the right; every seventh pixel has no reading.
struct View {
  test::OwnedSurface surface{kPixels, kPixels};

  View() {
    Surface& s = *surface;
    s.grid.width = kWidth;
    s.grid.height = kHeight;
    s.grid.intrinsics = {kWidth, kHeight, 110.0, 111.0, 59.5, 44.5};
    s.has_viewpoint = true;
    s.spacing_m = 0.01;
    for (std::size_t pixel = 0; pixel < kPixels; ++pixel) {
      s.grid.point_of[pixel] = -1;
      if (pixel % 7 == 3) continue;
      const double u = static_cast<double>(pixel % kWidth);
      const double v = static_cast<double>(pixel / kWidth);
      const Vec3d ray((u - 59.5) / 110.0, (v - 44.5) / 111.0, 1.0);
      const double z = u < 60.0 ? -kTilted.z() / -kTilted.dot(ray) : 1.5;
      s.x[s.size] = static_cast<float>(ray.x() * z);
      s.y[s.size] = static_cast<float>(ray.y() * z);
      s.z[s.size] = static_cast<float>(z);
      s.grid.pixel_of[s.size] = static_cast<std::int32_t>(pixel);
      s.grid.point_of[pixel] = static_cast<std::int32_t>(s.size++);
    }
  }
};

class ViewGridTest : public testing::Test {
 protected:
  ViewGrid grid_;
  test::ArenaMemory memory_{[this](Arena& arena) { grid_.reserve(arena, limits()); }};
  View view_;
  test::OwnedSurface thinned_{kPixels, 0};
};

TEST_F(ViewGridTest, KeepsEveryReadingInItsBlock) {
  const Surface& view = *view_.surface;
  ASSERT_TRUE(grid_.take(view, 1, 0.05, false, *thinned_));
  ASSERT_EQ(view.size, thinned_->size);
  for (std::size_t i = 0; i < view.size; ++i) EXPECT_EQ(view.point(i), thinned_->point(i));
}

TEST_F(ViewGridTest, AveragesWhatAFirstReadingsSurfaceShows) {
  const Surface& view = *view_.surface;
  ASSERT_TRUE(grid_.take(view, 4, 0.05, false, *thinned_));
  // The planes part at a block's edge, and block 0 lacks pixels 3, 121 + 1 and 241 + 4: it is
  // averaged plainly.
  Vec3d sum = Vec3d::Zero();
  double count = 0.0;
  for (int v = 0; v < 4; ++v) {
    for (int u = 0; u < 4; ++u) {
      const std::int32_t i = view.grid.point_of[static_cast<std::size_t>(v * kWidth + u)];
      if (i < 0) continue;
      sum += view.point(static_cast<std::size_t>(i)).cast<double>();
      count += 1.0;
    }
  }
  EXPECT_LT((thinned_->point(0).cast<double>() - sum / count).norm(), 1e-6);
  EXPECT_EQ(30U * 23U, thinned_->size);
  // Blocks of three pixels that hold both planes leave the farther readings as they are.
  ASSERT_TRUE(grid_.take(view, 4, 1e-5, false, *thinned_));
  EXPECT_GT(thinned_->size, 30U * 23U);
}

TEST_F(ViewGridTest, FitsPlanesUpToTheirEdges) {
  const Surface& view = *view_.surface;
  for (const int stride : {1, 2, 3}) {
    ASSERT_TRUE(grid_.take(view, stride, 0.05, false, *thinned_));
    ASSERT_TRUE(grid_.normals(0.05, 1.1, *thinned_));
    std::size_t tilted = 0;
    for (std::size_t i = 0; i < thinned_->size; ++i) {
      ASSERT_TRUE(thinned_->has_normal(i)) << stride << " " << i;
      const bool left = thinned_->z[i] < 1.49F;
      const Vec3d normal = thinned_->normal(i).cast<double>();
      // Means of blocks with holes lie off their pixels' middles: that bends planes a little.
      const double off = normal.cross(left ? kTilted : Vec3d(0.0, 0.0, -1.0)).norm();
      tilted += left ? 1 : 0;
      EXPECT_LT(off, stride == 1 ? 2e-3 : 0.05) << stride << " " << i;
      EXPECT_LT(normal.dot(thinned_->point(i).cast<double>()), 0.0);
    }
    EXPECT_GT(tilted, thinned_->size / 3);
  }
}

TEST_F(ViewGridTest, KeepsTheSideOfGivenNormals) {
  Surface& view = *view_.surface;
  for (std::size_t i = 0; i < view.size; ++i) view.nz[i] = 1.0F;
  ASSERT_TRUE(grid_.take(view, 2, 0.05, true, *thinned_));
  ASSERT_TRUE(grid_.normals(0.05, 1.1, *thinned_));
  for (std::size_t i = 0; i < thinned_->size; ++i) EXPECT_GT(thinned_->nz[i], 0.0F);
}

TEST_F(ViewGridTest, RefusesPointsThatLieOffTheirPixels) {
  Surface& view = *view_.surface;
  for (std::size_t i = 0; i < view.size; ++i) view.x[i] += 0.05F;
  ASSERT_TRUE(grid_.take(view, 2, 0.05, false, *thinned_));
  EXPECT_FALSE(grid_.normals(0.05, 1.1, *thinned_));
}

TEST_F(ViewGridTest, RefusesAViewLargerThanItsRoom) {
  ViewGrid small;
  Limits less = limits();
  less.max_width = less.max_height = 40;
  const test::ArenaMemory memory([&](Arena& arena) { small.reserve(arena, less); });
  EXPECT_FALSE(small.take(*view_.surface, 1, 0.05, false, *thinned_));
}

}  // namespace
}  // namespace grapnel
