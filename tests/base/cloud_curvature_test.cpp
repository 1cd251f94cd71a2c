#include <gtest/gtest.h>

#include <filesystem>

#include "base/cloud_file.h"

namespace grapnel {
namespace {

TEST(CloudFiles, CarryTheCurvatureOfEveryPoint) {
  CloudData cloud;
  cloud.x = {0.0F, 1.0F, 2.0F};
  cloud.y = cloud.z = cloud.x;
  cloud.curvature = {0.0F, 0.125F, 0.25F};
  cloud.width = 3;
  for (const char* name : {"curvature_test.pcd", "curvature_test.ply"}) {
    const std::filesystem::path file = std::filesystem::temp_directory_path() / name;
    write_cloud(file, cloud);
    EXPECT_EQ(read_cloud(file).curvature, cloud.curvature) << name;
    std::filesystem::remove(file);
  }
}

}  // namespace
}  // namespace grapnel
