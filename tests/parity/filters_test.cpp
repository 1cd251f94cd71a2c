// PCL's own expected numbers for filters: test/filters/test_filters.cpp, on the clouds it loads.
#include <gtest/gtest.h>

#include <array>
#include <string>
#include <utility>

#include "base/cloud_file.h"
#include "pipeline/preprocess/crop.h"
#include "pipeline/preprocess/radius_outliers.h"
#include "pipeline/preprocess/statistical_outliers.h"
#include "pipeline/preprocess/voxel.h"
#include "pipeline/preprocess/z_median.h"
#include "tests/pipeline/support/surfaces.h"
#include "tests/support/recorded_data.h"

namespace grapnel {
namespace {

template <class Filter>
struct Reserved {
  Filter filter;
  test::ArenaMemory memory;
  template <class Params>
  Reserved(const Params& params, const Limits& limits)
      : filter(params), memory([&](Arena& arena) { filter.reserve(arena, limits); }) {}
};

class PclFilters : public testing::Test {
 protected:
  static CloudData load(const char* file) {
    const std::filesystem::path path =
        test::recorded_data(("pcl_test/" + std::string(file)).c_str());
    return path.empty() ? CloudData{} : read_cloud(path);
  }
};

TEST_F(PclFilters, StatisticalOutlierRemovalKeeps352) {
  const CloudData cloud = load("bun0.pcd");
  if (cloud.size() == 0) GTEST_SKIP() << test::kNoRecordedData;
  for (const Engine engine : {Engine::Fast, Engine::Reference}) {
    test::OwnedSurface surface = test::surface_of(cloud);
    Reserved<StatisticalOutliers> s(StatisticalOutlierParams{50, 1.0, engine},
                                    test::small_limits());
    ASSERT_TRUE(s.filter.apply(*surface).ok());
    ASSERT_EQ(surface->size, 352U);
    EXPECT_NEAR(surface->x[351], -0.034667F, 1e-4F);
    EXPECT_NEAR(surface->y[351], 0.15131F, 1e-4F);
    EXPECT_NEAR(surface->z[351], -0.00071029F, 1e-4F);
  }
}

TEST_F(PclFilters, RadiusOutlierRemovalKeeps307) {
  const CloudData cloud = load("bun0.pcd");
  if (cloud.size() == 0) GTEST_SKIP() << test::kNoRecordedData;
  test::OwnedSurface surface = test::surface_of(cloud);
  RadiusOutlierParams params;
  params.radius_m = 0.02;
  params.min_neighbours = 14;
  Reserved<RadiusOutliers> r(params, test::small_limits());
  ASSERT_TRUE(r.filter.apply(*surface).ok());
  EXPECT_EQ(surface->size, 307U);
}

// VoxelGrid with filter limits of z, 0.05 to 0.1, then the same negated.
TEST_F(PclFilters, VoxelsBetweenTwoHeightsAre14AndOutsideOfThem100) {
  const CloudData cloud = load("bun0.pcd");
  if (cloud.size() == 0) GTEST_SKIP() << test::kNoRecordedData;
  for (const auto& [inside, cells] : {std::pair{true, 14U}, std::pair{false, 100U}}) {
    test::OwnedSurface surface = test::surface_of(cloud);
    CropParams limits;
    limits.min_z_m = 0.05;
    limits.max_z_m = 0.1;
    limits.inside = inside;
    Reserved<Crop> crop(limits, test::small_limits());
    Reserved<VoxelGrid> voxels(VoxelParams{0.02, 6000}, test::small_limits());
    ASSERT_TRUE(crop.filter.apply(*surface).ok());
    ASSERT_TRUE(voxels.filter.apply(*surface).ok());
    EXPECT_EQ(surface->size, cells);
  }
}

TEST_F(PclFilters, MedianOfThreePixelsOnFiveByFiveByHand) {
  constexpr float kGiven[25] = {1, 2, 3, 4, 5, 6, 7, 8,   9,   10,  10,  9,  8,
                                7, 6, 5, 4, 3, 2, 1, 100, 100, 500, 100, 100};
  constexpr float kMedian[25] = {6, 6, 7,  8, 9, 7, 7, 7,   7,   7,   7,   7,  7,
                                 7, 7, 10, 9, 8, 7, 7, 100, 100, 100, 100, 100};
  for (const float most : {1e6F, 50.0F}) {
    test::OwnedSurface surface(25, 25);
    surface->size = 25;
    surface->grid.width = surface->grid.height = 5;
    surface->grid.intrinsics = {5, 5, 5.0, 5.0, 2.0, 2.0};
    for (std::size_t i = 0; i < 25; ++i) {
      surface->z[i] = kGiven[i];
      surface->grid.point_of[i] = surface->grid.pixel_of[i] = static_cast<std::int32_t>(i);
    }
    Reserved<ZMedian> m(ZMedianParams{3, static_cast<double>(most), false}, test::small_limits());
    ASSERT_TRUE(m.filter.apply(*surface).ok());
    for (std::size_t i = 0; i < 25; ++i) {
      // The 500 may move by 50 only.
      const float expected = i == 22 && most == 50.0F ? 450.0F : kMedian[i];
      EXPECT_NEAR(surface->z[i], expected, 1e-5F) << i;
    }
  }
}

TEST_F(PclFilters, MedianOfSevenPixelsOnARecordedFrame) {
  const CloudData cloud = load("milk_cartoon_all_small_clorox.pcd");
  if (cloud.size() == 0) GTEST_SKIP() << test::kNoRecordedData;
  ASSERT_EQ(cloud.width, 640);
  Intrinsics intrinsics;
  intrinsics.fx = intrinsics.fy = 525.0;
  intrinsics.cx = 319.5;
  intrinsics.cy = 239.5;
  intrinsics.width = 640;
  intrinsics.height = 480;
  test::OwnedSurface surface = test::grid_surface_of(cloud, intrinsics);
  ZMedianParams params;
  params.window = 7;
  params.max_movement_m = 0.01;
  params.keep_rays = false;
  Reserved<ZMedian> m(params, Limits{});
  ASSERT_TRUE(m.filter.apply(*surface).ok());
  struct Expected {
    int u, v;
    float z;
  };
  for (const Expected& e :
       {Expected{30, 100, 1.301F}, Expected{50, 100, 1.301F}, Expected{90, 100, 1.306F},
        Expected{50, 200, 0.908F}, Expected{100, 300, 0.695F}, Expected{128, 128, 1.177F},
        Expected{256, 256, 0.779F}, Expected{428, 300, 0.703F}}) {
    const std::int32_t point = surface->grid.point_of[static_cast<std::size_t>(e.v * 640 + e.u)];
    ASSERT_GE(point, 0);
    EXPECT_NEAR(surface->z[static_cast<std::size_t>(point)], e.z, 1e-5F) << e.u << ", " << e.v;
  }
}

}  // namespace
}  // namespace grapnel
