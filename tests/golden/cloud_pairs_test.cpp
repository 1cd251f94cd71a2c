// Pairs of clouds without a camera's grid, by the command line.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

#include "base/geometry.h"
#include "tests/support/recorded_data.h"
#include "tests/workbench/text_file.h"

namespace grapnel {
namespace {

using test::CommandRun;
using test::recorded_data;
using test::run_command;
using Json = nlohmann::json;

struct Found {
  int code = -1;
  Pose pose = Pose::Identity();
};

/// What `register SOURCE TARGET` answers.
Found register_clouds(const std::string& source, const std::string& target) {
  const CommandRun run = run_command({"register", source, target, "--json"});
  EXPECT_LE(run.code, 1) << run.error;
  Found found;
  found.code = run.code;
  if (run.code > 1) return found;
  const Json rows = Json::parse(run.out).at("transform");
  for (int i = 0; i < 16; ++i) {
    found.pose.matrix()(i / 4, i % 4) =
        rows.at(static_cast<std::size_t>(i / 4)).at(static_cast<std::size_t>(i % 4));
  }
  return found;
}

void expect_near(const Pose& found, const Pose& truth, const Vec3d& middle, double tolerance_m,
                 double tolerance_rad) {
  EXPECT_LT((found * middle - truth * middle).norm(), tolerance_m);
  EXPECT_LT(rotation_angle_rad(found, truth), tolerance_rad);
}

/// bun045 in bun000's frame: the row of bun.conf, its quaternion conjugated (the folder's README).
Pose scan_000_from_045() {
  Pose pose = Pose::Identity();
  pose.translation() = Vec3d(-0.0520211, -0.000383981, -0.0109223);
  pose.linear() = Eigen::Quaterniond(0.955586, -0.00548449, 0.294635, 0.0038555)
                      .normalized()
                      .toRotationMatrix();
  return pose;
}

// 400 points, 6 mm apart: of one file's normals and the other's none nothing may follow about
// sides. Half a spacing and 2 degrees of what the scans in full were aligned to; too few points
// confirm some motions for the verdict to accept.
TEST(CloudPairs, SparseScansComeTogetherThoughOneHasNormals) {
  const std::string with_normals = recorded_data("pcl_test/bun0.pcd");
  if (with_normals.empty()) GTEST_SKIP() << test::kNoRecordedData;
  const std::string without = recorded_data("pcl_test/bun4.pcd");
  const Vec3d middle(-0.02, 0.1, 0.0);
  expect_near(register_clouds(without, with_normals).pose, scan_000_from_045(), middle, 0.003,
              0.035);
  expect_near(register_clouds(with_normals, without).pose, scan_000_from_045().inverse(), middle,
              0.003, 0.035);
}

// Points alone, no normals, no viewpoint in the file: they lie before their first camera. 5 cm and
// 5 degrees: the given motion itself leaves a median of 9 mm (the folder's README).
TEST(CloudPairs, FragmentsOfARoomComeTogether) {
  const std::string log = recorded_data("3dmatch_redkitchen/gt.log");
  if (log.empty()) GTEST_SKIP() << test::kNoRecordedData;
  Pose first_from_fourth = Pose::Identity();
  std::ifstream stream(log);
  int i = 0;
  int j = 0;
  int count = 0;
  bool known = false;
  while (!known && stream >> i >> j >> count) {
    for (int k = 0; k < 16; ++k) stream >> first_from_fourth.matrix()(k / 4, k % 4);
    known = i == 0 && j == 4;
  }
  ASSERT_TRUE(known);
  const std::string first = recorded_data("3dmatch_redkitchen/cloud_bin_0.ply");
  const std::string fourth = recorded_data("3dmatch_redkitchen/cloud_bin_4.ply");
  const Found forward = register_clouds(fourth, first);
  const Found back = register_clouds(first, fourth);
  EXPECT_EQ(forward.code, 0);
  EXPECT_EQ(back.code, 0);
  expect_near(forward.pose, first_from_fourth, {0.0, 0.0, 2.5}, 0.05, 0.087);
  expect_near(back.pose, first_from_fourth.inverse(), {0.0, 0.0, 2.5}, 0.05, 0.087);
}

}  // namespace
}  // namespace grapnel
