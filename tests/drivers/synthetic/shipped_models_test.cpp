#include "drivers/synthetic/shipped_models.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "base/config.h"
#include "base/geometry.h"
#include "drivers/synthetic/shapes.h"

namespace grapnel {
namespace {

namespace fs = std::filesystem;

const fs::path kShipped = fs::path(GRAPNEL_SOURCE_DIR) / "config/models";

std::string bytes_of(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

const std::vector<ShippedModel>& models() {
  static const std::vector<ShippedModel> kModels = make_shipped_models();
  return kModels;
}

TEST(ShippedModels, AreWhatTheirProgramMakes) {
  const fs::path folder = fs::path(testing::TempDir()) / "shipped_models";
  fs::remove_all(folder);
  write_models(models(), folder);
  std::size_t compared = 0;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    const fs::path name = entry.path().filename();
    EXPECT_TRUE(bytes_of(entry.path()) == bytes_of(kShipped / name)) << name;
    ++compared;
  }
  EXPECT_EQ(compared, 8u);
  fs::remove_all(folder);
}

TEST(ShippedModels, HaveAtMostTwentyThousandPointsWithUnitNormals) {
  for (const ShippedModel& model : models()) {
    EXPECT_LE(model.cloud.size(), 20000u) << model.name;
    EXPECT_GE(model.cloud.size(), 5000u) << model.name;
    ASSERT_TRUE(model.cloud.has_normals());
    for (std::size_t i = 0; i < model.cloud.size(); ++i) {
      const float square = model.cloud.nx[i] * model.cloud.nx[i] +
                           model.cloud.ny[i] * model.cloud.ny[i] +
                           model.cloud.nz[i] * model.cloud.nz[i];
      EXPECT_NEAR(square, 1.0f, 1e-6f);
    }
  }
}

TEST(ShippedModels, GraspsLieOnTheSurfaceAndPointIntoThePart) {
  for (const ShippedModel& model : models()) {
    const ConfigTable table = parse_config(model.toml, model.name);
    ConfigReader reader(table);
    const auto grasps = reader.take_tables("grasp");
    ASSERT_EQ(grasps.size(), 1u);
    ConfigReader grasp(*grasps[0]);
    const std::vector<double> pose = grasp.take_numbers("model_from_grasp", 16);
    ASSERT_EQ(pose.size(), 16u);
    const Vec3d place_m(pose[3], pose[7], pose[11]);
    double nearest_m = 1.0;
    Vec3d normal = Vec3d::Zero();
    for (std::size_t i = 0; i < model.cloud.size(); ++i) {
      const Vec3f point(model.cloud.x[i], model.cloud.y[i], model.cloud.z[i]);
      const double distance_m = (point.cast<double>() - place_m).norm();
      if (distance_m >= nearest_m) continue;
      nearest_m = distance_m;
      normal = Vec3f(model.cloud.nx[i], model.cloud.ny[i], model.cloud.nz[i]).cast<double>();
    }
    EXPECT_LT(Vec3d(pose[2], pose[6], pose[10]).dot(normal), -0.5) << model.name;
    EXPECT_LT(nearest_m, 0.006) << model.name << ": further than the points' spacing";
  }
}

TEST(ShippedModels, SayTheSymmetryOfTheirShape) {
  EXPECT_NE(models()[0].toml.find("symmetry = \"box\""), std::string::npos);
  EXPECT_NE(models()[1].toml.find("symmetry = \"none\""), std::string::npos);
  EXPECT_NE(models()[2].toml.find("symmetry = \"axis_z\""), std::string::npos);
  EXPECT_NE(models()[3].toml.find("symmetry = \"none\""), std::string::npos);
}

}  // namespace
}  // namespace grapnel
