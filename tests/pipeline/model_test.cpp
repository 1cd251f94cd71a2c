#include "pipeline/model.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>

#include "base/cloud_file.h"
#include "base/input_error.h"
#include "base/rng.h"
#include "tests/pipeline/support/box_scene.h"
#include "tests/support/temp_folder.h"

namespace grapnel {
namespace {

class ModelFile : public testing::Test {
 protected:
  void write(const std::string& toml) {
    write_ply(folder_.path() / "part.ply", test::box_cloud(Vec3d(0.4, 0.3, 0.2), 0.01));
    std::ofstream(folder_.path() / "part.toml") << toml;
  }
  [[nodiscard]] Model load() const { return load_model(folder_.path() / "part.ply"); }
  [[nodiscard]] std::string refusal() const {
    try {
      static_cast<void>(load());
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  }

  test::TempFolder folder_;
};

TEST_F(ModelFile, BringsSymmetryGraspsAndUnit) {
  write(R"(
unit_m = 0.5
id = 7
symmetry = "box"
[[grasp]]
id = 3
name = "top"
model_from_grasp = [1,0,0,0, 0,-1,0,0, 0,0,-1,0.1, 0,0,0,1]
required = ["x", "rz"]
)");
  const Model model = load();
  EXPECT_EQ(model.name, "part");
  EXPECT_EQ(model.id, 7);
  EXPECT_EQ(model.symmetry, Symmetry::Box);
  EXPECT_NEAR(model.diameter_m, 0.5 * Vec3d(0.4, 0.3, 0.2).norm(), 1e-6);
  EXPECT_NEAR(model.spacing_m, 0.005, 1e-3);  // points of an edge are there twice
  ASSERT_EQ(model.grasps.size(), 1U);
  EXPECT_EQ(model.grasps[0].id, 3);
  EXPECT_NEAR(model.grasps[0].model_from_grasp.translation().z(), 0.1, 1e-12);
  EXPECT_EQ(model.grasps[0].required.size(), 2U);
}

TEST_F(ModelFile, WithoutADescriptionHasOneGraspAtTheOrigin) {
  write_ply(folder_.path() / "part.ply", test::box_cloud(Vec3d(0.4, 0.3, 0.2), 0.01));
  const Model model = load();
  EXPECT_EQ(model.symmetry, Symmetry::None);
  ASSERT_EQ(model.grasps.size(), 1U);
  EXPECT_TRUE(model.grasps[0].model_from_grasp.isApprox(Pose::Identity()));
}

TEST_F(ModelFile, WrongDescriptionsNameFileLineAndKey) {
  write("symmetry = \"square\"\n");
  EXPECT_NE(refusal().find("part.toml:1: symmetry"), std::string::npos) << refusal();
  write("unit_mm = 1.0\n");
  EXPECT_NE(refusal().find("unit_m"), std::string::npos) << refusal();
  write("[[grasp]]\nmodel_from_grasp = [2,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1]\n");
  EXPECT_NE(refusal().find("part.toml:2"), std::string::npos) << refusal();
  write("[[grasp]]\nid = 1\n[[grasp]]\nid = 1\n");
  EXPECT_NE(refusal().find("part.toml:4"), std::string::npos) << refusal();
  write("unit_m = 900.0\n");
  EXPECT_NE(refusal().find("unit"), std::string::npos) << refusal();
}

TEST_F(ModelFile, TheHashFollowsPointsAndDescription) {
  write("symmetry = \"box\"\n");
  const std::uint64_t first = load().hash;
  EXPECT_EQ(load().hash, first);
  write("symmetry = \"none\"\n");
  EXPECT_NE(load().hash, first);
}

TEST(ModelNormals, PointOutwardOnABumpyBall) {
  test::OwnedSurface ball = test::bumpy_ball(6000, 0.1);
  CloudData cloud;
  for (std::size_t i = 0; i < ball->size; ++i) {
    cloud.x.push_back(ball->x[i]);
    cloud.y.push_back(ball->y[i]);
    cloud.z.push_back(ball->z[i]);
  }
  cloud.width = static_cast<int>(cloud.size());
  const Model model = model_from_cloud(cloud, "ball");
  for (std::size_t i = 0; i < model.size(); ++i) {
    const Vec3f normal(model.nx[i], model.ny[i], model.nz[i]);
    EXPECT_NEAR(normal.norm(), 1.0F, 1e-5F);
    EXPECT_GT(normal.dot(Vec3f(model.x[i], model.y[i], model.z[i])), 0.0F);
  }
}

TEST(ModelNormals, OfAThickCloudAreThoseOfItsMiddle) {
  // Thirty thousand readings of a sphere with 1 mm of noise: neighbours of one point lie along the
  // noise, not along the surface.
  Rng rng(3);
  CloudData cloud;
  for (int i = 0; i < 30000; ++i) {
    const Vec3d direction = Vec3d(rng.normal(), rng.normal(), rng.normal()).normalized();
    const Vec3d p = (0.1 + 0.001 * rng.normal()) * direction;
    cloud.x.push_back(static_cast<float>(p.x()));
    cloud.y.push_back(static_cast<float>(p.y()));
    cloud.z.push_back(static_cast<float>(p.z()));
  }
  cloud.width = static_cast<int>(cloud.size());
  const Model model = model_from_cloud(cloud, "sphere");
  std::size_t good = 0;
  for (std::size_t i = 0; i < model.size(); ++i) {
    const Vec3f p(model.x[i], model.y[i], model.z[i]);
    const float cosine = Vec3f(model.nx[i], model.ny[i], model.nz[i]).dot(p.normalized());
    good += cosine > 0.94F ? 1U : 0U;  // within 20 degrees
  }
  EXPECT_GT(good, 95 * model.size() / 100);
}

TEST(ModelFromCloud, RefusesFewPoints) {
  CloudData cloud;
  cloud.x = cloud.y = cloud.z = {0.0F, 0.1F};
  cloud.width = 2;
  EXPECT_THROW(static_cast<void>(model_from_cloud(cloud, "few")), InputError);
}

}  // namespace
}  // namespace grapnel
