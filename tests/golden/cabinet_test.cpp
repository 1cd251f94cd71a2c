// A real box in real pictures: the cabinet of TUM's freiburg3_cabinet, taken with an Asus Xtion,
// found by `grapnel evaluate` with the general preset and a model made of its sizes. Truth is the
// recorded pose refined on the depth by a fit that shares no code with the pipeline.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "tests/support/box_fit.h"
#include "tests/support/cabinet_set.h"
#include "tests/support/recorded_data.h"
#include "tests/support/temp_folder.h"
#include "tests/workbench/text_file.h"

namespace grapnel {
namespace {

using test::CabinetSet;
using test::recorded_data;
using test::TempFolder;
using Json = nlohmann::json;

constexpr double kDegree = 0.017453;

struct Score {
  int accepted = 0;
  int within = 0;  ///< 15 mm and 3 degrees
  int beyond = 0;  ///< 45 mm or 9 degrees
};

Score evaluate(const CabinetSet& set, const Vec3d& model_half_m) {
  const TempFolder folder;
  test::write_cabinet_suite(set, model_half_m, folder / "suite");
  const test::CommandRun run =
      test::run_command({"evaluate", folder / "suite/suite.toml", "-o", folder / "out"});
  EXPECT_EQ(run.code, 0) << run.error;
  std::istringstream lines(test::text_of(folder / "out/results.jsonl"));
  Score score;
  for (std::string line; std::getline(lines, line);) {
    const Json result = Json::parse(line);
    if (result.at("status") != "accepted") continue;
    const double error_m = result.at("error_m");
    const double error_rad = result.at("error_rad");
    ++score.accepted;
    if (error_m <= 0.015 && error_rad <= 3.0 * kDegree) ++score.within;
    if (error_m > 0.045 || error_rad > 9.0 * kDegree) {
      ++score.beyond;
      ADD_FAILURE() << result.at("id") << " " << error_m << " m " << error_rad << " rad";
    }
  }
  return score;
}

/// A box on a floor, ray by ray, in counts of 0.2 mm.
std::vector<std::uint16_t> picture_of(const Pose& camera_from_box, const Vec3d& half_m,
                                      const Intrinsics& k) {
  const Pose box_from_camera = camera_from_box.inverse();
  const Vec3d camera = box_from_camera.translation();
  std::vector<std::uint16_t> counts;
  for (int v = 0; v < k.height; ++v) {
    for (int u = 0; u < k.width; ++u) {
      const Vec3d ray = box_from_camera.linear() * Vec3d((u - k.cx) / k.fx, (v - k.cy) / k.fy, 1.0);
      double z_m = (-half_m.z() - camera.z()) / ray.z();
      double in_m = 0.0;
      double out_m = 1e9;
      for (int axis = 0; axis < 3; ++axis) {
        const double a = (-half_m[axis] - camera[axis]) / ray[axis];
        const double b = (half_m[axis] - camera[axis]) / ray[axis];
        in_m = std::max(in_m, std::min(a, b));
        out_m = std::min(out_m, std::max(a, b));
      }
      if (in_m < out_m) z_m = in_m;
      const bool seen = z_m > 0.0 && z_m < 8.0;
      counts.push_back(seen ? static_cast<std::uint16_t>(z_m * 5000.0 + 0.5) : std::uint16_t{0});
    }
  }
  return counts;
}

TEST(BoxFit, RecoversPosesAndSizesOfAnExactBox) {
  const Vec3d half_m(0.39, 0.21, 0.27);
  const Vec3d wrong_half_m(0.40, 0.22, 0.27);
  const Intrinsics camera = {640, 480, 535.0, 535.0, 319.5, 239.5};
  std::vector<Pose> truth;
  std::vector<test::BoxView> views;
  for (const double turn_rad : {0.5, 2.2, 3.9}) {
    // Looking down by 40 degrees: the box's z is up, the camera's is ahead.
    Pose pose = Pose::Identity();
    pose.linear() = rotation_from_vector(Vec3d(130.0 * kDegree, 0.0, 0.0)) *
                    rotation_from_vector(Vec3d(0.0, 0.0, turn_rad));
    pose.translation() = Vec3d(0.05, 0.0, 1.8);
    const std::vector<std::uint16_t> counts = picture_of(pose, half_m, camera);
    Pose start = pose;
    start.linear() = pose.linear() * rotation_from_vector(Vec3d(0.01, -0.02, 0.02));
    start.translation() += Vec3d(0.015, -0.012, 0.01);
    truth.push_back(pose);
    views.push_back(
        test::box_view({{counts.data(), 640, 480}, 0.0002, camera}, start, wrong_half_m, 0.09));
  }
  Vec3d fitted_m = wrong_half_m;
  test::fit_boxes(views, fitted_m);
  // Rims are known to half a pixel, 1.7 mm at this distance.
  EXPECT_NEAR(fitted_m.x(), half_m.x(), 0.002);
  EXPECT_NEAR(fitted_m.y(), half_m.y(), 0.002);
  for (std::size_t i = 0; i < views.size(); ++i) {
    const Pose error = truth[i].inverse() * views[i].camera_from_box;
    EXPECT_LT(error.translation().norm(), 0.002) << i;
    EXPECT_LT(rotation_angle_rad(error, Pose::Identity()), 0.1 * kDegree) << i;
    EXPECT_LT(test::median_residual_m(views[i], fitted_m), 0.001) << i;
  }
}

TEST(Cabinet, IsFoundInPicturesWhosePoseIsKnown) {
  const std::filesystem::path folder = recorded_data("tum_fr3_cabinet");
  if (folder.empty()) GTEST_SKIP() << test::kNoRecordedData;
  const CabinetSet set = test::read_cabinet(folder, test::good_cabinet_images());
  for (const CabinetSet::Image& image : set.images) {
    // The sensor's own noise at 1.2 to 2 m; the recorded poses leave 5 to 8 mm.
    EXPECT_LT(image.residual_m, 0.0035) << image.index;
    EXPECT_LT(image.moved_m, 0.04) << image.index;
  }
  const Score score = evaluate(set, set.half_m);
  EXPECT_EQ(score.beyond, 0);
  EXPECT_GE(score.within, 16) << "of 19, 80 %";
}

// With the sizes as recorded, 9 and 18 mm longer than the box, as a drawing may be wrong.
TEST(Cabinet, IsNotAcceptedAtAWrongPoseInTheOtherPictures) {
  const std::filesystem::path folder = recorded_data("tum_fr3_cabinet");
  if (folder.empty()) GTEST_SKIP() << test::kNoRecordedData;
  const std::vector<int> good = test::good_cabinet_images();
  std::vector<int> others;
  for (int image = 0; image < 40; ++image) {
    if (std::find(good.begin(), good.end(), image) == good.end()) others.push_back(image);
  }
  const CabinetSet set = test::read_cabinet(folder, others);
  EXPECT_EQ(evaluate(set, set.recorded_half_m).beyond, 0);
}

}  // namespace
}  // namespace grapnel
