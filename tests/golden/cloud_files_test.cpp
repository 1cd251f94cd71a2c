// Clouds that other programs wrote, against what their own folders say of them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "base/cloud_file.h"
#include "tests/support/recorded_data.h"

namespace grapnel {
namespace {

std::size_t valid_points(const CloudData& cloud) {
  return static_cast<std::size_t>(
      std::count_if(cloud.z.begin(), cloud.z.end(), [](float z) { return std::isfinite(z); }));
}

struct Expected {
  const char* file;
  int width;
  int height;
  std::size_t valid;
  bool normals;
  bool color;
};

void PrintTo(const Expected& expected, std::ostream* out) { *out << expected.file; }

class RecordedCloud : public testing::TestWithParam<Expected> {};

TEST_P(RecordedCloud, HasTheStatedShapeAndCount) {
  const Expected& expected = GetParam();
  const std::filesystem::path file = test::recorded_data(expected.file);
  if (file.empty()) GTEST_SKIP() << test::kNoRecordedData;
  const CloudData cloud = read_cloud(file);
  EXPECT_EQ(cloud.width, expected.width);
  EXPECT_EQ(cloud.height, expected.height);
  EXPECT_EQ(cloud.size(), static_cast<std::size_t>(expected.width * expected.height));
  EXPECT_EQ(valid_points(cloud), expected.valid);
  EXPECT_EQ(cloud.has_normals(), expected.normals);
  EXPECT_EQ(cloud.has_color(), expected.color);
}

// Counts from the headers and the folders' README files.
INSTANTIATE_TEST_SUITE_P(
    Clouds, RecordedCloud,
    testing::Values(
        Expected{"pcl_test/bun0.pcd", 397, 1, 397, true, false},
        Expected{"pcl_test/bun4.pcd", 361, 1, 361, false, false},
        Expected{"pcl_test/milk.pcd", 13704, 1, 13704, false, false},
        Expected{"pcl_test/milk_cartoon_all_small_clorox.pcd", 640, 480, 241407, false, true},
        Expected{"pcl_test/colored_cloud.pcd", 1000, 1, 1000, true, true},
        Expected{"pcl_test/cturtle.pcd", 167198, 1, 167198, false, false},
        Expected{"pcl_test/rops_cloud.pcd", 32087, 1, 32087, false, false},
        Expected{"pcl_test/sac_plane_test.pcd", 3283, 1, 3283, true, false},
        Expected{"pcl_tutorials/region_growing_rgb_tutorial.pcd", 640, 480, 259847, false, true},
        Expected{"pcl_tutorials/milk_tutorial.pcd", 12575, 1, 12575, false, true},
        Expected{"stanford_bunny/bun000.ply", 40256, 1, 40256, false, false},
        Expected{"stanford_bunny/bun045.ply", 40097, 1, 40097, false, false},
        Expected{"3dmatch_redkitchen/cloud_bin_0.ply", 258342, 1, 258342, false, false},
        Expected{"pallet_boxes/small_box/small_box_0_raw.ply", 3056, 1, 3056, true, true},
        Expected{"icbin_bin_picking/2/model.ply", 32774, 1, 32774, true, true}));

TEST(RecordedClouds, FirstBunnyPointIsTheOneInTheText) {
  const std::filesystem::path file = test::recorded_data("pcl_test/bun0.pcd");
  if (file.empty()) GTEST_SKIP() << test::kNoRecordedData;
  const CloudData cloud = read_cloud(file);
  EXPECT_EQ(cloud.x[0], 0.0054215998f);
  EXPECT_EQ(cloud.y[0], 0.11349f);
  EXPECT_EQ(cloud.z[0], 0.040748999f);
}

TEST(RecordedClouds, LabelsBeforeTheCoordinatesNameTheTableAndTheObjects) {
  const std::filesystem::path file = test::recorded_data("mosd/learn0.pcd");
  if (file.empty()) GTEST_SKIP() << test::kNoRecordedData;
  const CloudData cloud = read_cloud(file);
  ASSERT_EQ(cloud.label.size(), cloud.size());
  std::size_t table = 0;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const std::uint32_t label = cloud.label[i];
    EXPECT_TRUE(label < 10 || label >= 20) << label;
    if (label >= 1 && label < 10) ++table;
    if (!std::isfinite(cloud.z[i])) continue;
    ASSERT_GE(cloud.z[i], 0.54f - 0.01f);
    ASSERT_LE(cloud.z[i], 1.7f + 0.01f);
  }
  EXPECT_GT(table, 0u);
}

TEST(RecordedClouds, MilkCartonIsPartOfItsScenePointForPoint) {
  const std::filesystem::path folder = test::recorded_data("pcl_test");
  if (folder.empty()) GTEST_SKIP() << test::kNoRecordedData;
  const CloudData scene = read_cloud(folder / "milk_cartoon_all_small_clorox.pcd");
  const CloudData milk = read_cloud(folder / "milk.pcd");
  std::vector<std::array<float, 3>> points;
  for (std::size_t i = 0; i < scene.size(); ++i) {
    if (std::isfinite(scene.z[i])) points.push_back({scene.x[i], scene.y[i], scene.z[i]});
  }
  std::sort(points.begin(), points.end());
  for (std::size_t i = 0; i < milk.size(); ++i) {
    const std::array<float, 3> point = {milk.x[i], milk.y[i], milk.z[i]};
    ASSERT_TRUE(std::binary_search(points.begin(), points.end(), point)) << "point " << i;
  }
}

TEST(RecordedClouds, MeshesHaveTheirDeclaredFaces) {
  const std::filesystem::path cup = test::recorded_data("icbin_bin_picking/2/model.ply");
  const std::filesystem::path box =
      test::recorded_data("pallet_boxes/small_box/small_box_mesh.ply");
  if (cup.empty() || box.empty()) GTEST_SKIP() << test::kNoRecordedData;
  EXPECT_EQ(read_mesh(cup).triangles.size(), 65217u);
  const MeshData mesh = read_mesh(box);
  EXPECT_EQ(mesh.triangles.size(), 6021u);
  Vec3f low = mesh.vertices.front();
  Vec3f high = low;
  for (const Vec3f& vertex : mesh.vertices) {
    low = low.cwiseMin(vertex);
    high = high.cwiseMax(vertex);
  }
  Vec3f size = high - low;
  std::sort(size.begin(), size.end());
  // The folder's README: 264.6 x 170.0 x 108.2 mm, rounded to 0.1.
  EXPECT_NEAR(size[0], 108.2f, 0.051f);
  EXPECT_NEAR(size[1], 170.0f, 0.051f);
  EXPECT_NEAR(size[2], 264.6f, 0.051f);
}

}  // namespace
}  // namespace grapnel
