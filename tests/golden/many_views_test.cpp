// Many views of the PrimeSense bunny without their poses: poses_N.txt take the camera of view N to
// the object.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <filesystem>
#include <fstream>
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
using test::write_text;
using testing::HasSubstr;
using Json = nlohmann::json;

// The folder's README: the poses are good to 0.4-1.7 mm and 0.2-1.2 degrees.
constexpr double kTolerance_m = 0.003;
constexpr double kTolerance_rad = 0.0349;
/// The bunny's middle in view 0, in front of the camera.
const Vec3d kMiddle(0.0, 0.0, 0.44);

std::string bunny(const std::string& name) {
  return recorded_data(("primesense_bunny/" + name).c_str());
}

/// The files' rotations are all scaled by the same 0.9966: only their quotients are rigid.
Pose first_from_view(int first, int view) {
  const auto load = [](int number) {
    std::ifstream stream(bunny("poses_" + std::to_string(number) + ".txt"));
    Mat4d matrix = Mat4d::Identity();
    for (int i = 0; i < 16; ++i) stream >> matrix(i / 4, i % 4);
    return matrix;
  };
  Pose pose;
  pose.matrix() = load(first).inverse() * load(view);
  return pose;
}

Pose pose_of(const Json& rows) {
  Pose pose = Pose::Identity();
  for (std::size_t i = 0; i < 16; ++i) {
    pose.matrix()(static_cast<int>(i / 4), static_cast<int>(i % 4)) = rows.at(i / 4).at(i % 4);
  }
  return pose;
}

void expect_near_truth(const Pose& found, const Pose& truth, const std::string& what) {
  const Pose error = truth.inverse() * found;
  EXPECT_LT((error * kMiddle - kMiddle).norm(), kTolerance_m) << what;
  EXPECT_LT(rotation_angle_rad(error, Pose::Identity()), kTolerance_rad) << what;
}

std::string write_camera(const TempFolder& folder) {
  return write_text(folder / "camera.toml",
                    "width = 640\nheight = 480\nfx = 542.0\nfy = 540.5\ncx = 320.0\ncy = 240.0\n"
                    "metres_per_unit = 0.001\n");
}

TEST(RegisterManyCommand, BringsViewsTogetherAndFusesThem) {
  if (recorded_data("primesense_bunny").empty()) GTEST_SKIP() << test::kNoRecordedData;
  const TempFolder folder;
  const std::vector<int> numbers = {0, 2, 4, 6, 8};
  std::vector<std::string> args = {"register-many", "--camera", write_camera(folder),
                                   "--json",        "-o",       folder / "fused.ply"};
  for (const int number : numbers)
    args.push_back(bunny("depth_" + std::to_string(number) + ".png"));
  const CommandRun run = run_command(args);
  ASSERT_EQ(run.code, 0) << run.out << run.error;
  const Json json = Json::parse(run.out);
  EXPECT_EQ(json.at("status"), "accepted");
  ASSERT_EQ(json.at("views").size(), numbers.size());
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    const Json& view = json.at("views").at(i);
    EXPECT_TRUE(view.at("connected"));
    EXPECT_TRUE(view.at("confirmed"));
    expect_near_truth(pose_of(view.at("transform")), first_from_view(0, numbers[i]),
                      "view " + std::to_string(numbers[i]));
  }
  EXPECT_EQ(json.at("edges").size(), 10U);
  EXPECT_GT(json.at("loops").at("count"), 2);
  EXPECT_LT(json.at("loops").at("max_m"), 0.003);
  EXPECT_GT(read_cloud(folder / "fused.ply").size(), 5000U);
}

// Half the walk around: five views make the model, those between them are the scenes.
TEST(TeachCommand, MakesAModelOfViewsWithoutPosesThatIsFoundInTheOthers) {
  if (recorded_data("primesense_bunny").empty()) GTEST_SKIP() << test::kNoRecordedData;
  const TempFolder folder;
  const std::string camera = write_camera(folder);
  const std::string model = folder / "bunny.ply";
  std::vector<std::string> args = {"teach", "--camera", camera, "--json", "-o", model};
  for (const int view : {0, 2, 4, 6, 8}) {
    args.push_back(bunny("depth_" + std::to_string(view) + ".png"));
  }
  const CommandRun taught = run_command(args);
  ASSERT_EQ(taught.code, 0) << taught.out << taught.error;
  const Json json = Json::parse(taught.out);
  EXPECT_EQ(json.at("frames"), 5);
  EXPECT_LT(json.at("common_frame").at("loops").at("max_m"), 0.003);
  const Json& quality = json.at("quality");
  // Five caps of 30 degrees, 20 degrees apart: between two and five separate ones.
  EXPECT_GT(quality.at("view_sphere_coverage"), 0.13);
  EXPECT_LT(quality.at("view_sphere_coverage"), 0.34);
  EXPECT_LT(quality.at("side_open_share").at("-z"), 0.2);  // where the first camera was
  EXPECT_LT(quality.at("overlap_rms_m"), 0.001);           // as the folder's README measured it
  EXPECT_TRUE(std::filesystem::exists(folder / "bunny.toml"));
  EXPECT_TRUE(std::filesystem::exists(folder / "bunny.png"));

  for (const int view : {1, 3, 5, 7}) {
    const CommandRun found =
        run_command({"register", model, bunny("depth_" + std::to_string(view) + ".png"), "--camera",
                     camera, "--object", "--json"});
    ASSERT_EQ(found.code, 0) << found.out << found.error;
    const Pose view_from_first = pose_of(Json::parse(found.out).at("transform"));
    expect_near_truth(view_from_first.inverse(), first_from_view(0, view),
                      "view " + std::to_string(view));
  }
}

TEST(EvaluateCommand, RunsACaseOfManyViews) {
  if (recorded_data("primesense_bunny").empty()) GTEST_SKIP() << test::kNoRecordedData;
  const TempFolder folder;
  const std::string camera = write_camera(folder);
  std::ostringstream text;
  text.precision(12);
  text << "[suite]\nname = \"walk\"\ntolerance_m = 0.003\ntolerance_rad = 0.0349\n"
       << "[[case]]\nid = \"walk\"\nkind = \"many\"\ncamera = \"" << camera << "\"\n";
  for (const int view : {0, 2, 4}) {
    text << "[[case.view]]\nsource = \"" << bunny("depth_" + std::to_string(view) + ".png")
         << "\"\ntruth = [";
    const Pose truth = first_from_view(0, view);
    for (int i = 0; i < 16; ++i) text << (i > 0 ? ", " : "") << truth.matrix()(i / 4, i % 4);
    text << "]\n";
  }
  const std::string suite = write_text(folder / "suite.toml", text.str());
  const CommandRun run = run_command({"evaluate", suite, "-o", folder / "out"});
  ASSERT_EQ(run.code, 0) << run.error;
  const Json line = Json::parse(test::text_of(folder / "out" / "results.jsonl"));
  EXPECT_EQ(line.at("status"), "accepted") << line.dump();
  EXPECT_EQ(line.at("right"), true) << line.dump();
  EXPECT_EQ(line.at("views").size(), 3U);
  EXPECT_LT(line.at("error_m"), 0.003);
}

TEST(RegisterManyCommand, NamesTheViewThatDoesNotBelong) {
  if (recorded_data("primesense_bunny").empty()) GTEST_SKIP() << test::kNoRecordedData;
  const TempFolder folder;
  const std::string milk = recorded_data("pcl_test/milk.pcd");
  const CommandRun run = run_command({"register-many", "--camera", write_camera(folder), "--json",
                                      bunny("depth_0.png"), milk, bunny("depth_2.png")});
  EXPECT_EQ(run.code, 1) << run.out << run.error;
  const Json json = Json::parse(run.out);
  EXPECT_EQ(json.at("status"), "rejected");
  EXPECT_TRUE(json.at("views").at(2).at("connected"));
  EXPECT_FALSE(json.at("views").at(1).at("connected"));
  EXPECT_FALSE(json.at("views").at(1).contains("transform"));
  ASSERT_EQ(json.at("reasons").size(), 1U);
  EXPECT_THAT(json.at("reasons").at(0).get<std::string>(), HasSubstr("milk.pcd"));
}

}  // namespace
}  // namespace grapnel
