// Models in recorded frames: job A on real Kinect and PrimeSense data.
#include <gtest/gtest.h>

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include "base/cloud_file.h"
#include "base/rng.h"
#include "drivers/replay/camera_file.h"
#include "drivers/replay/image_file.h"
#include "pipeline/registrar.h"
#include "tests/support/recorded_data.h"

namespace grapnel {
namespace {

namespace fs = std::filesystem;

const fs::path kConfig = fs::path(GRAPNEL_SOURCE_DIR) / "config";

Preset preset_named(const std::string& name) {
  return load_preset(find_preset(kConfig / "presets", name), kConfig / "models");
}

Pose random_pose(Rng& rng, double reach_m) {
  Eigen::Quaterniond turn(rng.normal(), rng.normal(), rng.normal(), rng.normal());
  Pose pose = Pose::Identity();
  pose.linear() = turn.normalized().toRotationMatrix();
  Vec3d direction(rng.normal(), rng.normal(), rng.normal());
  pose.translation() = direction.normalized() * rng.uniform(0.0, reach_m);
  return pose;
}

CloudData moved(const CloudData& cloud, const Eigen::Matrix4d& motion) {
  CloudData result;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const Eigen::Vector4d p = motion * Eigen::Vector4d(cloud.x[i], cloud.y[i], cloud.z[i], 1.0);
    result.x.push_back(static_cast<float>(p.x()));
    result.y.push_back(static_cast<float>(p.y()));
    result.z.push_back(static_cast<float>(p.z()));
  }
  result.width = static_cast<int>(result.size());
  return result;
}

double mean_error_m(const Model& model, const Pose& found, const Eigen::Matrix4d& truth) {
  double sum = 0.0;
  for (std::size_t i = 0; i < model.size(); ++i) {
    const Vec3d p(model.x[i], model.y[i], model.z[i]);
    sum += (found * p - (truth * p.homogeneous()).head<3>()).norm();
  }
  return sum / static_cast<double>(model.size());
}

double turn_error_rad(const Pose& found, const Eigen::Matrix4d& truth) {
  const Eigen::JacobiSVD<Mat3d> svd(truth.topLeftCorner<3, 3>(),
                                    Eigen::ComputeFullU | Eigen::ComputeFullV);
  Pose rigid = Pose::Identity();
  rigid.linear() = svd.matrixU() * svd.matrixV().transpose();
  return rotation_angle_rad(found, rigid);
}

struct DepthPixels {
  DepthImage image;
  DepthFrame frame;
};

std::unique_ptr<DepthPixels> read_frame(const fs::path& file, const Intrinsics& intrinsics,
                                        double metres_per_unit) {
  auto pixels = std::make_unique<DepthPixels>();
  pixels->image = read_depth_png(file);
  pixels->frame.depth = pixels->image.view();
  pixels->frame.metres_per_unit = metres_per_unit;
  pixels->frame.intrinsics = intrinsics;
  return pixels;
}

TEST(KinectTable, TheCartonIsFoundFromAnyStart) {
  const fs::path scene_file = test::recorded_data("pcl_test/milk_cartoon_all_small_clorox.pcd");
  const fs::path carton_file = test::recorded_data("pcl_test/milk.pcd");
  if (scene_file.empty() || carton_file.empty()) GTEST_SKIP() << test::kNoRecordedData;
  const CloudData scene = read_cloud(scene_file);
  // The cloud is a Kinect's, 525 px and its middle, on its own grid.
  std::vector<std::uint16_t> counts(scene.size(), 0);
  for (std::size_t i = 0; i < scene.size(); ++i) {
    if (std::isfinite(scene.z[i])) {
      counts[i] = static_cast<std::uint16_t>(std::lround(scene.z[i] * 10000.0F));
    }
  }
  DepthFrame frame;
  frame.depth = {counts.data(), scene.width, scene.height};
  frame.metres_per_unit = 0.0001;
  frame.intrinsics = {scene.width, scene.height, 525.0, 525.0, 319.5, 239.5};
  const CloudData carton = read_cloud(carton_file);
  Rng rng(1);
  for (int start = 0; start < 5; ++start) {
    const Pose motion = random_pose(rng, 1.0);
    Preset preset = preset_named("object");
    preset.models = {model_from_cloud(moved(carton, motion.matrix()), "carton")};
    const auto registrar = Registrar::create(preset);
    const Result<RegistrationReports> result = registrar->run(frame, {});
    ASSERT_TRUE(result.ok());
    ASSERT_FALSE(result.value().objects.empty());
    const RegistrationReport& report = result.value().objects[0];
    EXPECT_TRUE(report.accepted) << start << " " << static_cast<int>(report.code);
    // The carton was cut out of this very scene: truth is the inverse motion.
    const Eigen::Matrix4d truth = motion.inverse().matrix();
    EXPECT_LT(mean_error_m(preset.models[0], report.target_from_source, truth), 0.005);
    EXPECT_LT(turn_error_rad(report.target_from_source, truth), 2.0 * 0.01745);
  }
}

TEST(PrimesenseBunny, AModelOfTheEvenViewsIsFoundInTheOddOnes) {
  const fs::path folder = test::recorded_data("primesense_bunny");
  if (folder.empty()) GTEST_SKIP() << test::kNoRecordedData;
  const Intrinsics intrinsics = {640, 480, 542.0, 540.5, 320.0, 240.0};
  std::vector<Eigen::Matrix4d> object_from_camera;
  std::vector<std::unique_ptr<DepthPixels>> views;
  CloudData fused;
  for (int view = 0; view < 18; ++view) {
    const std::string number = std::to_string(view);
    std::ifstream poses(folder / ("poses_" + number + ".txt"));
    Eigen::Matrix4d pose;
    for (int i = 0; i < 16; ++i) poses >> pose(i / 4, i % 4);
    object_from_camera.push_back(pose);
    views.push_back(read_frame(folder / ("depth_" + number + ".png"), intrinsics, 0.001));
    if (view % 2 == 1) continue;
    for (int v = 0; v < 480; ++v) {
      for (int u = 0; u < 640; ++u) {
        const double z = views.back()->frame.depth.at(u, v) * 0.001;
        if (!(z > 0.0)) continue;
        const Eigen::Vector4d p =
            pose * Eigen::Vector4d((u - 320.0) / 542.0 * z, (v - 240.0) / 540.5 * z, z, 1.0);
        fused.x.push_back(static_cast<float>(p.x()));
        fused.y.push_back(static_cast<float>(p.y()));
        fused.z.push_back(static_cast<float>(p.z()));
      }
    }
  }
  fused.width = static_cast<int>(fused.size());
  Rng rng(2);
  for (int start = 0; start < 2; ++start) {
    const Pose motion = random_pose(rng, 1.0);
    Preset preset = preset_named("object");
    preset.models = {model_from_cloud(moved(fused, motion.matrix()), "bunny")};
    const auto registrar = Registrar::create(preset);
    for (int view = 1; view < 18; view += 2) {
      const Result<RegistrationReports> result =
          registrar->run(views[static_cast<std::size_t>(view)]->frame, {});
      ASSERT_TRUE(result.ok());
      ASSERT_FALSE(result.value().objects.empty());
      const RegistrationReport& report = result.value().objects[0];
      // The recorded poses hold a scale of 0.997, so truth is the quotient of whole matrices.
      const Eigen::Matrix4d truth =
          object_from_camera[static_cast<std::size_t>(view)].inverse() * motion.inverse().matrix();
      EXPECT_LT(mean_error_m(preset.models[0], report.target_from_source, truth), 0.003) << view;
      EXPECT_LT(turn_error_rad(report.target_from_source, truth), 2.0 * 0.01745) << view;
    }
  }
}

TEST(OfficeFrames, HoldNoneOfTheConveyorsParts) {
  const fs::path folder = test::recorded_data("tum_fr1_rpy/depth");
  if (folder.empty()) GTEST_SKIP() << test::kNoRecordedData;
  std::vector<fs::path> files;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  const Intrinsics intrinsics = {640, 480, 517.3, 516.5, 318.6, 255.3};
  std::vector<std::unique_ptr<Registrar>> registrars;
  for (const char* part : {"carton", "box", "barrel", "sack"}) {
    registrars.push_back(Registrar::create(preset_named(part)));
  }
  for (std::size_t i = 0; i < files.size(); i += 6) {
    const auto pixels = read_frame(files[i], intrinsics, 0.0002);
    const auto& registrar = registrars[(i / 6) % registrars.size()];
    const Result<RegistrationReports> result = registrar->run(pixels->frame, {});
    if (!result.ok()) continue;
    for (const RegistrationReport& report : result.value().objects) {
      EXPECT_FALSE(report.accepted) << files[i];
    }
  }
}

}  // namespace
}  // namespace grapnel
