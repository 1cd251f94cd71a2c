// NARF against PCL's, which states no numbers of its own: borders, the interest image and the
// keypoints of the same planar range image, with PCL's complete interest image.
#include <gtest/gtest.h>
#include <pcl/features/range_image_border_extractor.h>
#include <pcl/keypoints/narf_keypoint.h>
#include <pcl/range_image/range_image_planar.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "base/cloud_file.h"
#include "pipeline/keypoints/narf.h"
#include "tests/parity/pcl/clouds.h"
#include "tests/support/recorded_data.h"

namespace grapnel {
namespace {

/// Calls use(pixel, the same pixel's index in PCL's image, which has no rim).
template <class Use>
void each_pixel(const RangeImage& image, const Use& use) {
  std::size_t their = 0;
  for (int v = 0; v < image.height; ++v) {
    for (int u = 0; u < image.width; ++u) use(image.at(u, v), their++);
  }
}

/// Both libraries' results over one grid of depths (0 = no reading).
struct Both {
  NarfDetector ours;
  KeypointSet set;
  test::ArenaMemory memory;
  pcl::RangeImagePlanar image;
  pcl::RangeImageBorderExtractor extractor;
  pcl::NarfKeypoint theirs{&extractor};
  pcl::PointCloud<int> keypoints;

  Both(Surface& surface, const NarfParams& params)
      : ours(params), memory([&](Arena& arena) {
          ours.reserve(arena, test::limits_for(surface));
          set = KeypointSet(arena.take<Keypoint>(surface.size));
        }) {
    EXPECT_TRUE(ours.detect(surface, set).ok());
    // The same points, bit by bit, in the image that ours looked at.
    const RangeImage& seen = ours.image();
    std::vector<float> depth(static_cast<std::size_t>(seen.width * seen.height), 0.0F);
    image.setDepthImage(depth.data(), seen.width, seen.height, static_cast<float>(seen.cx),
                        static_cast<float>(seen.cy), static_cast<float>(seen.fx),
                        static_cast<float>(seen.fy));
    each_pixel(seen, [&](std::size_t i, std::size_t their) {
      if (!seen.valid(i)) return;
      image[their].x = seen.x[i];
      image[their].y = seen.y[i];
      image[their].z = seen.z[i];
      image[their].range = seen.range[i];
    });
    theirs.setRangeImage(&image);
    theirs.getParameters().support_size = static_cast<float>(params.support_m);
    theirs.getParameters().calculate_sparse_interest_image = false;
    theirs.compute(keypoints);
  }
};

NarfParams pcl_params(Engine engine, double support_m) {
  NarfParams params;
  params.engine = engine;
  params.support_m = support_m;
  params.fill_shadows = false;
  params.pyramid = false;
  return params;
}

double overlap(std::size_t both, std::size_t either) {
  return either == 0 ? 1.0 : static_cast<double>(both) / static_cast<double>(either);
}

void expect_same_borders(const Both& b) {
  const RangeImage& image = b.ours.image();
  const auto& theirs = const_cast<Both&>(b).extractor.getBorderDescriptions();
  std::array<std::size_t, 3> both{};
  std::array<std::size_t, 3> either{};
  each_pixel(image, [&](std::size_t i, std::size_t their) {
    const pcl::BorderTraits& traits = theirs[their].traits;
    const std::array<bool, 3> a = {b.ours.borders().obstacle(i), b.ours.borders().shadow(i),
                                   b.ours.borders().veil(i)};
    const std::array<bool, 3> c = {traits[pcl::BORDER_TRAIT__OBSTACLE_BORDER],
                                   traits[pcl::BORDER_TRAIT__SHADOW_BORDER],
                                   traits[pcl::BORDER_TRAIT__VEIL_POINT]};
    for (std::size_t k = 0; k < 3; ++k) {
      both[k] += a[k] && c[k] ? 1 : 0;
      either[k] += a[k] || c[k] ? 1 : 0;
    }
  });
  EXPECT_GT(either[0], 50U);
  // A score on a threshold may fall to either side in single precision.
  for (std::size_t k = 0; k < 3; ++k) EXPECT_GE(overlap(both[k], either[k]), 0.98) << k;
}

/// With min_interest 0 the fast engine leaves nothing out.
void expect_same_interest(Both& b) {
  const RangeImage& image = b.ours.image();
  const float* theirs = b.theirs.getInterestImage();
  double sum_a = 0.0;
  double sum_b = 0.0;
  double aa = 0.0;
  double bb = 0.0;
  double ab = 0.0;
  std::size_t near = 0;
  each_pixel(image, [&](std::size_t i, std::size_t their) {
    const auto ours = static_cast<double>(b.ours.interest(i));
    const auto other = static_cast<double>(theirs[their]);
    sum_a += ours;
    sum_b += other;
    aa += ours * ours;
    bb += other * other;
    ab += ours * other;
    near += std::fabs(ours - other) < 0.05 ? 1 : 0;
  });
  const auto n = static_cast<double>(image.width * image.height);
  const double correlation =
      (ab - sum_a * sum_b / n) / std::sqrt((aa - sum_a * sum_a / n) * (bb - sum_b * sum_b / n));
  EXPECT_GT(correlation, 0.98);
  // A direction on the edge of a 10 degree cell falls to either side in single precision.
  EXPECT_GT(static_cast<double>(near) / n, 0.95);
}

void expect_same_keypoints(const Both& b, const Surface& surface, double distance_m, double share) {
  std::size_t common = 0;
  for (const int pixel : b.keypoints) {
    const Vec3f place = b.image[static_cast<std::size_t>(pixel)].getVector3fMap();
    common += std::any_of(b.set.begin(), b.set.end(), [&](const Keypoint& keypoint) {
      return (surface.point(static_cast<std::size_t>(keypoint.point)) - place).norm() <= distance_m;
    });
  }
  EXPECT_GT(b.keypoints.size(), 0U);
  EXPECT_GE(static_cast<double>(common), share * static_cast<double>(b.keypoints.size()));
  EXPECT_LE(b.set.size(), b.keypoints.size() + b.keypoints.size() / 10 + 1);
}

class NarfAgainstPcl : public testing::TestWithParam<Engine> {};
INSTANTIATE_TEST_SUITE_P(BothEngines, NarfAgainstPcl,
                         testing::Values(Engine::Fast, Engine::Reference));

/// Boxes of different heights on a table, seen from above at a slant.
test::OwnedSurface boxes(int width, int height) {
  const auto pixels = static_cast<std::size_t>(width * height);
  test::OwnedSurface owned(pixels, pixels);
  Surface& s = *owned;
  const double focal = 0.9 * width;
  s.grid.width = width;
  s.grid.height = height;
  s.grid.intrinsics = {width, height, focal, focal, 0.5 * (width - 1), 0.5 * (height - 1)};
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      double z = 1.2 + 0.002 * v;
      if (u > width / 5 && u < width / 2 && v > height / 4 && v < height / 2 + u / 8) z -= 0.2;
      if (u > width * 3 / 5 && u + v / 3 < width && v > height / 3 && v < height * 4 / 5) z -= 0.12;
      const std::size_t i = s.size++;
      s.grid.point_of[static_cast<std::size_t>(v * width + u)] = static_cast<std::int32_t>(i);
      s.grid.pixel_of[i] = v * width + u;
      s.x[i] = static_cast<float>((u - s.grid.intrinsics.cx) * z / focal);
      s.y[i] = static_cast<float>((v - s.grid.intrinsics.cy) * z / focal);
      s.z[i] = static_cast<float>(z);
    }
  }
  s.has_viewpoint = true;
  s.spacing_m = 1.2 / focal;
  return owned;
}

TEST_P(NarfAgainstPcl, AgreesOnBoxes) {
  test::OwnedSurface scene = boxes(120, 90);
  NarfParams every = pcl_params(GetParam(), 0.2);
  every.min_interest = 0.0;
  Both image(*scene, every);
  expect_same_interest(image);
  Both both(*scene, pcl_params(GetParam(), 0.2));
  expect_same_borders(both);
  expect_same_keypoints(both, *scene, 1e-5, 1.0);
}

TEST_P(NarfAgainstPcl, AgreesOnARecordedTable) {
  const std::filesystem::path file =
      test::recorded_data("pcl_test/milk_cartoon_all_small_clorox.pcd");
  if (file.empty()) GTEST_SKIP() << test::kNoRecordedData;
  const CloudData cloud = read_cloud(file);
  ASSERT_EQ(cloud.width, 640);
  // Every fourth pixel: PCL takes seconds for the whole frame.
  constexpr int kStep = 4;
  CloudData coarse;
  coarse.width = cloud.width / kStep;
  coarse.height = cloud.height / kStep;
  for (int v = 0; v < coarse.height; ++v) {
    for (int u = 0; u < coarse.width; ++u) {
      const auto i = static_cast<std::size_t>(v * kStep * cloud.width + u * kStep);
      coarse.x.push_back(cloud.x[i]);
      coarse.y.push_back(cloud.y[i]);
      coarse.z.push_back(cloud.z[i]);
    }
  }
  // The Kinect's intrinsics, divided by the step.
  const Intrinsics k{coarse.width, coarse.height, 131.25, 131.25, 79.875, 59.875};
  test::OwnedSurface scene = test::grid_surface_of(coarse, k);
  NarfParams every = pcl_params(GetParam(), 0.2);
  every.min_interest = 0.0;
  Both image(*scene, every);
  expect_same_interest(image);
  Both both(*scene, pcl_params(GetParam(), 0.2));
  expect_same_borders(both);
  expect_same_keypoints(both, *scene, 0.02, 0.8);
}

}  // namespace
}  // namespace grapnel
