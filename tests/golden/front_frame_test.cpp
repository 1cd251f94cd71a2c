// The front end's depth steps on PCL's Kinect scene of a table with a carton and bottles.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <vector>

#include "base/cloud_file.h"
#include "pipeline/preprocess/background.h"
#include "pipeline/preprocess/decimate.h"
#include "pipeline/preprocess/depth_outliers.h"
#include "pipeline/preprocess/median.h"
#include "pipeline/preprocess/normals.h"
#include "pipeline/preprocess/organize.h"
#include "pipeline/preprocess/segment.h"
#include "tests/pipeline/support/surfaces.h"
#include "tests/support/recorded_data.h"

namespace grapnel {
namespace {

/// The frame that the organised cloud was made from; counts of 1 mm.
test::TestFrame frame_of(const CloudData& cloud) {
  test::TestFrame frame(cloud.width, cloud.height, 525.0);
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    if (std::isfinite(cloud.z[i])) {
      frame.counts[i] = static_cast<std::uint16_t>(std::lround(cloud.z[i] * 1000.0F));
    }
  }
  return frame;
}

TEST(KinectTable, TheCartonIsAComponentOfItsOwn) {
  const std::filesystem::path scene_file =
      test::recorded_data("pcl_test/milk_cartoon_all_small_clorox.pcd");
  const std::filesystem::path carton_file = test::recorded_data("pcl_test/milk.pcd");
  if (scene_file.empty() || carton_file.empty()) GTEST_SKIP() << test::kNoRecordedData;
  test::TestFrame frame = frame_of(read_cloud(scene_file));
  const CloudData carton = read_cloud(carton_file);

  Limits limits;
  WorkingDepth work;
  DepthMedian median{{}};
  DepthOutliers outliers{{}};
  BackgroundRemoval background{{}};
  Segmenter segmenter{{}};
  PcaNormals normals{{}};
  Surface surface;
  const test::ArenaMemory memory([&](Arena& arena) {
    work.reserve(arena, limits);
    median.reserve(arena, limits);
    outliers.reserve(arena, limits);
    background.reserve(arena, limits);
    segmenter.reserve(arena, limits);
    normals.reserve(arena, limits);
    surface.reserve(arena, limits.max_points, 640 * 480);
  });
  ASSERT_TRUE(organize(frame.frame, {}, work).ok());
  median.apply(work);
  outliers.apply(work);
  Rng rng(1);
  const BackgroundReport report = background.apply(work, {}, 0.3, rng);
  EXPECT_EQ(report.used, BackgroundMethod::Dominant);
  Components components;
  segmenter.apply(work, components);
  ASSERT_GE(components.size(), 3U) << "a carton and bottles stand on the table";

  // milk.pcd lies in the scene's own coordinates: where its points project, the label is the
  // carton's.
  std::vector<std::size_t> votes(256, 0);
  const Intrinsics& k = work.intrinsics;
  for (std::size_t i = 0; i < carton.size(); ++i) {
    const auto u = static_cast<int>(std::lround(k.fx * carton.x[i] / carton.z[i] + k.cx));
    const auto v = static_cast<int>(std::lround(k.fy * carton.y[i] / carton.z[i] + k.cy));
    if (u >= 0 && v >= 0 && u < work.label.width && v < work.label.height) {
      ++votes[work.label.at(u, v)];
    }
  }
  std::uint8_t label = 1;
  for (std::uint8_t l = 1; l <= components.size(); ++l) {
    if (votes[l] > votes[label]) label = l;
  }
  EXPECT_GT(votes[label], carton.size() * 8 / 10) << "most of the carton in one component";
  EXPECT_LT(components[label - 1U].pixels, carton.size() * 3 / 2) << "and little else";

  ASSERT_TRUE(decimate(work, label, {}, {}, 0.005, surface).ok());
  EXPECT_NEAR(surface.spacing_m, 0.005, 0.0015);
  ASSERT_TRUE(normals.estimate(surface).ok());
  std::size_t with_normal = 0;
  for (std::size_t i = 0; i < surface.size; ++i) with_normal += surface.has_normal(i) ? 1U : 0U;
  EXPECT_GT(with_normal, surface.size * 95 / 100);
}

}  // namespace
}  // namespace grapnel
