// The command line on recorded data: PCL's Kinect scene and the milk carton cut out of it, whose
// true pose is the identity.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "base/cloud_file.h"
#include "base/geometry.h"
#include "tests/support/recorded_data.h"
#include "tests/support/temp_folder.h"
#include "tests/workbench/text_file.h"

namespace grapnel {
namespace {

using test::CommandRun;
using test::recorded_data;
using test::run_command;
using test::TempFolder;
using test::text_of;
using test::write_text;
using testing::HasSubstr;
using Json = nlohmann::json;

constexpr const char* kScene = "pcl_test/milk_cartoon_all_small_clorox.pcd";
constexpr const char* kMilk = "pcl_test/milk.pcd";

/// Some motion that leaves nothing where it was.
Pose motion() {
  Pose pose = Pose::Identity();
  pose.linear() = rotation_from_vector(Vec3d(1.9, -0.8, 1.1));
  pose.translation() = Vec3d(0.3, -0.5, 0.4);
  return pose;
}

/// milk.pcd moved by motion(), as a binary PLY without normals.
std::string moved_milk(const TempFolder& folder) {
  CloudData cloud = read_cloud(recorded_data(kMilk));
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const Vec3f p = (motion() * Vec3d(cloud.x[i], cloud.y[i], cloud.z[i])).cast<float>();
    cloud.x[i] = p.x();
    cloud.y[i] = p.y();
    cloud.z[i] = p.z();
  }
  const std::filesystem::path file = folder / "milk.ply";
  write_ply(file, cloud);
  return file;
}

Pose pose_of(const Json& rows) {
  Pose pose = Pose::Identity();
  for (int i = 0; i < 16; ++i) {
    pose.matrix()(i / 4, i % 4) =
        rows.at(static_cast<std::size_t>(i / 4)).at(static_cast<std::size_t>(i % 4));
  }
  return pose;
}

/// Mean displacement of the carton's points between the pose and the truth.
double error_m(const Pose& scene_from_moved) {
  const CloudData cloud = read_cloud(recorded_data(kMilk));
  double sum = 0.0;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const Vec3d p(cloud.x[i], cloud.y[i], cloud.z[i]);
    sum += (scene_from_moved * motion() * p - p).norm();
  }
  return sum / static_cast<double>(cloud.size());
}

std::string truth_text(const Pose& pose) {
  std::ostringstream text;
  text.precision(12);
  text << "truth = [";
  for (int i = 0; i < 16; ++i) text << (i > 0 ? ", " : "") << pose.matrix()(i / 4, i % 4);
  text << "]\n";
  return text.str();
}

TEST(RegisterCommand, FindsTheMilkCartonInItsScene) {
  const std::filesystem::path scene = recorded_data(kScene);
  if (scene.empty()) GTEST_SKIP() << test::kNoRecordedData;
  const TempFolder folder;
  const std::filesystem::path merged = folder / "merged.ply";
  const CommandRun run = run_command({"register", moved_milk(folder), scene, "--preset", "object",
                                      "--json", "--repeat", "2", "-o", merged});
  ASSERT_EQ(run.code, 0) << run.out << run.error;
  const Json json = Json::parse(run.out);
  EXPECT_EQ(json.at("status"), "accepted");
  EXPECT_LT(error_m(pose_of(json.at("transform"))), 0.005);
  EXPECT_LT(rotation_angle_rad(pose_of(json.at("transform")), motion().inverse()), 0.0349);
  for (const char* key : {"code", "fitness", "rmse_m", "coverage", "free_space_violation", "margin",
                          "sigma_m", "sigma_rad", "seed", "simd", "total_ms", "peak_bytes",
                          "total_ms_p50", "total_ms_p99", "total_ms_max"}) {
    EXPECT_TRUE(json.contains(key)) << key;
  }
  for (const char* key : {"source_points", "target_points", "source_keypoints", "target_keypoints",
                          "correspondences", "after_rejection", "hypotheses"}) {
    EXPECT_TRUE(json.at("counts").contains(key)) << key;
  }
  EXPECT_TRUE(json.at("stage_ms").contains("judge"));
  const CloudData together = read_cloud(merged);
  EXPECT_EQ(together.size(), 13704U + 241407U);  // the carton's points and the scene's valid ones
}

TEST(RegisterCommand, RejectsWithExitCodeOneAndSaysWhy) {
  const std::filesystem::path scene = recorded_data(kScene);
  if (scene.empty()) GTEST_SKIP() << test::kNoRecordedData;
  const std::string bunny = recorded_data("pcl_test/bun0.pcd");
  const CommandRun run = run_command({"register", bunny, scene, "--object"});
  EXPECT_EQ(run.code, 1) << run.out << run.error;
  EXPECT_THAT(run.out, HasSubstr("Rejected"));
}

TEST(RegisterCommand, AnswersUnreadableInputInOneLineWithExitCodeTwo) {
  const std::filesystem::path scene = recorded_data(kScene);
  if (scene.empty()) GTEST_SKIP() << test::kNoRecordedData;
  const CommandRun run = run_command({"register", "no_such.ply", scene, "--object"});
  EXPECT_EQ(run.code, 2);
  EXPECT_THAT(run.error, HasSubstr("no_such.ply"));
  EXPECT_EQ(std::count(run.error.begin(), run.error.end(), '\n'), 1);
  EXPECT_EQ(run.out, "");
}

TEST(EvaluateCommand, JudgesAPositiveANegativeAndAFileThatIsMissing) {
  const std::filesystem::path scene = recorded_data(kScene);
  if (scene.empty()) GTEST_SKIP() << test::kNoRecordedData;
  const TempFolder folder;
  const std::string target = "kind = \"scene\"\ntarget = \"" + scene.string() + "\"\n";
  const std::string suite = write_text(
      folder / "suite.toml",
      "[suite]\nname = \"two\"\ntolerance_m = 0.005\ntolerance_rad = 0.0349\n"
      "[[case]]\nid = \"milk\"\nsource = \"" +
          moved_milk(folder) + "\"\n" + target + truth_text(motion().inverse()) +
          "[[case]]\nid = \"bunny\"\nsource = \"" + recorded_data("pcl_test/bun0.pcd").string() +
          "\"\n" + target + "[[case]]\nid = \"none\"\nsource = \"none.ply\"\n" + target);
  const CommandRun run = run_command({"evaluate", suite, "-o", folder / "out", "--jobs", "2"});
  ASSERT_EQ(run.code, 0) << run.error;
  std::istringstream lines(text_of(folder / "out/results.jsonl"));
  std::vector<Json> results;
  for (std::string line; std::getline(lines, line);) results.push_back(Json::parse(line));
  ASSERT_EQ(results.size(), 3U);
  EXPECT_EQ(results[0].at("id"), "milk");
  EXPECT_EQ(results[0].at("preset"), "default");
  EXPECT_TRUE(results[0].at("right"));
  EXPECT_LT(results[0].at("error_m"), 0.005);
  EXPECT_EQ(results[1].at("status"), "rejected");
  EXPECT_EQ(results[2].at("status"), "error");
  EXPECT_EQ(results[2].at("code"), 5003);
  const Json all = Json::parse(text_of(folder / "out/summary.json")).at("presets").at("default");
  EXPECT_EQ(all.at("accepted_right"), 1);
  EXPECT_EQ(all.at("accepted_wrong"), 0);
  EXPECT_EQ(all.at("rejected_right"), 1);
  EXPECT_EQ(all.at("errors"), 1);
  EXPECT_THAT(text_of(folder / "out/report.html"), HasSubstr("milk"));
}

/// camera_from_object of a view, inverted from the recorded poses_N.txt.
Pose camera_from_object(int view) {
  const std::string name = "primesense_bunny/poses_" + std::to_string(view) + ".txt";
  std::istringstream words(text_of(recorded_data(name.c_str())));
  Mat4d object_from_camera;
  for (int i = 0; i < 16; ++i) words >> object_from_camera(i / 4, i % 4);
  Pose pose = Pose::Identity();
  pose.linear() = Eigen::Quaterniond(Mat3d(object_from_camera.topLeftCorner<3, 3>()))
                      .normalized()
                      .toRotationMatrix();
  pose.translation() = object_from_camera.topRightCorner<3, 1>();
  return pose.inverse();
}

// Even views make the model, an odd one is the scene: its recorded pose is the answer.
TEST(TeachCommand, MakesAModelThatIsFoundInAnotherView) {
  const std::filesystem::path views = recorded_data("primesense_bunny");
  if (views.empty()) GTEST_SKIP() << test::kNoRecordedData;
  const TempFolder folder;
  const std::string recording = folder / "recording";
  const std::string model = folder / "bunny.ply";
  ASSERT_EQ(run_command({"import", views, "-o", recording, "--without-color"}).code, 0);
  const CommandRun taught = run_command({"teach", recording, "--frames", "0-16:2", "-o", model});
  ASSERT_EQ(taught.code, 0) << taught.error;
  EXPECT_TRUE(std::filesystem::exists(folder / "bunny.toml"));
  const CloudData cloud = read_cloud(model);
  EXPECT_TRUE(cloud.has_normals());
  EXPECT_GT(cloud.size(), 5000U);

  const CommandRun found = run_command({"register", model, recording + "#3", "--json"});
  ASSERT_EQ(found.code, 0) << found.out << found.error;
  const Pose difference =
      camera_from_object(3).inverse() * pose_of(Json::parse(found.out).at("transform"));
  EXPECT_LT(difference.translation().norm(), 0.003);
  EXPECT_LT(rotation_angle_rad(difference, Pose::Identity()), 0.0349);
}

}  // namespace
}  // namespace grapnel
