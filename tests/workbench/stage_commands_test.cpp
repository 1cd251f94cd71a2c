// The commands that run one stage, on generated clouds.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "base/cloud_file.h"
#include "base/rng.h"
#include "tests/support/temp_folder.h"
#include "tests/workbench/text_file.h"

namespace grapnel {
namespace {

using test::CommandRun;
using test::run_command;
using test::TempFolder;
using test::text_of;
using test::write_text;
using testing::HasSubstr;
using Json = nlohmann::json;

/// A bumpy patch of 0.3 m, 5 mm apart, as a PCD; returns its path. The point at index 7 has no
/// reading.
std::string write_patch(const TempFolder& folder) {
  CloudData cloud;
  for (int row = 0; row < 60; ++row) {
    for (int column = 0; column < 60; ++column) {
      const double x = 0.005 * column;
      const double y = 0.005 * row;
      const double z = 0.02 * std::sin(31.0 * x) * std::cos(23.0 * y) + 0.05 * x * y;
      cloud.x.push_back(static_cast<float>(x));
      cloud.y.push_back(static_cast<float>(y));
      cloud.z.push_back(static_cast<float>(z));
    }
  }
  cloud.x[7] = cloud.y[7] = cloud.z[7] = std::nanf("");
  cloud.width = 3600;
  const std::filesystem::path file = folder / "patch.pcd";
  write_pcd(file, cloud);
  return file;
}

TEST(FilterCommand, LeavesOnePointAVoxel) {
  const TempFolder folder;
  const std::filesystem::path out = folder / "out.pcd";
  const CommandRun run = run_command({"filter", write_patch(folder), "--method", "voxel", "--set",
                                      "leaf_m=0.05", "-o", out, "--json"});
  ASSERT_EQ(run.code, 0) << run.error;
  const Json json = Json::parse(run.out);
  EXPECT_EQ(json.at("input_points"), 3599);
  const CloudData cloud = read_cloud(out);
  EXPECT_EQ(json.at("output_points"), cloud.size());
  EXPECT_GE(cloud.size(), 36U);  // 6 × 6 columns of voxels, one or two high
  EXPECT_LE(cloud.size(), 72U);
}

TEST(FilterCommand, EstimatesTheNormalsThatAMethodSamplesBy) {
  const TempFolder folder;
  const std::string patch = write_patch(folder);
  for (const char* const method : {"normal_space", "covariance_sampling"}) {
    const std::filesystem::path out = folder / (std::string(method) + ".pcd");
    const CommandRun run = run_command(
        {"filter", patch, "--method", method, "--set", "points=100", "-o", out, "--json"});
    ASSERT_EQ(run.code, 0) << method << run.error;
    EXPECT_EQ(read_cloud(out).size(), 100U) << method;
  }
}

TEST(CurvatureCommand, WritesARowForEveryPointWithAReading) {
  const TempFolder folder;
  const std::filesystem::path csv = folder / "out.csv";
  const CommandRun run =
      run_command({"curvature", write_patch(folder), "--set", "radius_m=0.02", "--csv", csv});
  ASSERT_EQ(run.code, 0) << run.error;
  std::istringstream lines(text_of(csv));
  std::size_t rows = 0;
  for (std::string line; std::getline(lines, line); ++rows) {
    std::istringstream cells(line);
    std::vector<double> values;
    for (std::string cell; std::getline(cells, cell, ',');) values.push_back(std::stod(cell));
    ASSERT_EQ(values.size(), 6U);
    EXPECT_NE(values[0], 7.0);
    EXPECT_GE(values[1], values[2]);
    EXPECT_GE(values[2], 0.0);
    EXPECT_NEAR(values[3] * values[3] + values[4] * values[4] + values[5] * values[5], 1.0, 1e-5);
  }
  EXPECT_EQ(rows, 3599U);
}

TEST(KeypointsCommand, RunsTheReferenceEngineAndRefusesOtherModes) {
  const TempFolder folder;
  const std::string patch = write_patch(folder);
  const auto points = [&](const std::string& mode) {
    const CommandRun run =
        run_command({"keypoints", patch, "--detector", "iss", "--mode", mode, "--json"});
    EXPECT_EQ(run.code, 0) << run.error;
    std::vector<int> indices;
    const Json json = Json::parse(run.out);
    for (const Json& keypoint : json.at("keypoints")) indices.push_back(keypoint.at("index"));
    return indices;
  };
  const std::vector<int> fast = points("fast");
  EXPECT_GT(fast.size(), 5U);
  EXPECT_EQ(points("reference"), fast);
  const CommandRun wrong = run_command({"keypoints", patch, "--detector", "iss", "--mode", "slow"});
  EXPECT_EQ(wrong.code, 2);
  EXPECT_THAT(wrong.error, HasSubstr("reference"));
  const CommandRun single =
      run_command({"keypoints", patch, "--detector", "uniform", "--mode", "reference"});
  EXPECT_EQ(single.code, 2);
}

TEST(NormalsCommand, KeepsEveryPointInItsPlace) {
  const TempFolder folder;
  const std::string patch = write_patch(folder);
  const std::filesystem::path out = folder / "out.pcd";
  const CommandRun run =
      run_command({"normals", patch, "--set", "radius_m=0.02", "--viewpoint", "0,0,5", "-o", out});
  ASSERT_EQ(run.code, 0) << run.error;
  const CloudData before = read_cloud(patch);
  const CloudData after = read_cloud(out);
  ASSERT_EQ(after.size(), before.size());
  ASSERT_TRUE(after.has_normals() && after.has_curvature());
  EXPECT_TRUE(std::isnan(after.nx[7]));
  for (std::size_t i = 0; i < after.size(); ++i) {
    if (i == 7) continue;
    EXPECT_EQ(after.x[i], before.x[i]);
    EXPECT_GT(after.nz[i], 0.5F);  // slopes of the patch stay below 40 degrees
    EXPECT_LT(after.curvature[i], 0.34F);
  }
}

TEST(KeypointsCommand, NamesPointsByTheirIndexInTheFile) {
  const TempFolder folder;
  const std::string patch = write_patch(folder);
  const CommandRun run = run_command({"keypoints", patch, "--detector", "uniform", "--set",
                                      "cell_m=0.03", "--set", "need_normal=false", "--json"});
  ASSERT_EQ(run.code, 0) << run.error;
  const CloudData cloud = read_cloud(patch);
  const Json list = Json::parse(run.out).at("keypoints");
  ASSERT_GT(list.size(), 50U);
  for (const Json& keypoint : list) {
    const std::size_t index = keypoint.at("index");
    EXPECT_EQ(keypoint.at("x").get<float>(), cloud.x.at(index));
    EXPECT_EQ(keypoint.at("z").get<float>(), cloud.z.at(index));
    EXPECT_TRUE(keypoint.contains("score") && keypoint.contains("scale"));
  }
}

// 1200 readings all over a picture of 320 × 240: NARF works on its pixels, not on its points.
TEST(KeypointsCommand, LooksAtAPictureOfFewReadings) {
  const TempFolder folder;
  CloudData cloud;
  cloud.width = 320;
  cloud.height = 240;
  for (int v = 0; v < cloud.height; ++v) {
    for (int u = 0; u < cloud.width; ++u) {
      const bool read = u % 8 == 0 && v % 8 == 0;
      const float z = read ? 1.0F : std::nanf("");
      cloud.x.push_back(z * (static_cast<float>(u) - 160.0F) / 260.0F);
      cloud.y.push_back(z * (static_cast<float>(v) - 120.0F) / 260.0F);
      cloud.z.push_back(z);
    }
  }
  const std::filesystem::path file = folder / "few.pcd";
  write_pcd(file, cloud);
  const CommandRun run = run_command({"keypoints", file, "--detector", "narf", "--json"});
  EXPECT_EQ(run.code, 0) << run.error;
  EXPECT_EQ(Json::parse(run.out).at("points"), 1200);
}

TEST(KeypointsCommand, RefusesAnUnknownDetectorAndKey) {
  const TempFolder folder;
  const std::string patch = write_patch(folder);
  const CommandRun detector = run_command({"keypoints", patch, "--detector", "isss"});
  EXPECT_EQ(detector.code, 2);
  EXPECT_THAT(detector.error, HasSubstr("iss"));
  const CommandRun key =
      run_command({"keypoints", patch, "--detector", "iss", "--set", "gama_21=0.9"});
  EXPECT_EQ(key.code, 2);
  EXPECT_THAT(key.error, HasSubstr("gamma_21"));
}

TEST(DescribeMatchReject, BringACloudBackToItself) {
  const TempFolder folder;
  const std::string patch = write_patch(folder);
  const std::string csv = folder / "features.csv";
  const CommandRun describe = run_command(
      {"describe", patch, "--descriptor", "fpfh", "--at", "610-3000:239", "--csv", csv});
  ASSERT_EQ(describe.code, 0) << describe.error;
  std::istringstream lines(text_of(csv));
  std::string first;
  std::getline(lines, first);
  EXPECT_TRUE(first.starts_with("610,"));
  EXPECT_EQ(std::count(first.begin(), first.end(), ','), 33);

  const CommandRun match = run_command({"match", csv, csv, "--metric", "l2", "--mutual", "--json"});
  ASSERT_EQ(match.code, 0) << match.error;
  const Json pairs = Json::parse(match.out).at("correspondences");
  EXPECT_EQ(pairs.size(), 11U);
  for (const Json& pair : pairs) {
    EXPECT_EQ(pair.at("source"), pair.at("target"));
    EXPECT_EQ(pair.at("distance"), 0.0);
  }

  const std::string file = write_text(folder / "pairs.json", match.out);
  const CommandRun reject = run_command(
      {"reject", patch, patch, "--correspondences", file, "--method", "median", "--json"});
  ASSERT_EQ(reject.code, 0) << reject.error;
  EXPECT_LE(Json::parse(reject.out).at("correspondences").size(), pairs.size());
}

TEST(DescribeCommand, RefusesAPointWithoutReading) {
  const TempFolder folder;
  const CommandRun run = run_command({"describe", write_patch(folder), "--descriptor", "fpfh",
                                      "--at", "7", "--csv", folder / "f.csv"});
  EXPECT_EQ(run.code, 2);
  EXPECT_THAT(run.error, HasSubstr("--at 7"));
}

TEST(CheckCommand, AcceptsTheShippedPresetAndRefusesABrokenOne) {
  const TempFolder folder;
  const std::string shipped = std::string(GRAPNEL_SOURCE_DIR) + "/config/presets/01-object.toml";
  EXPECT_EQ(run_command({"check", shipped}).code, 0);
  const std::string broken = write_text(folder / "05-broken.toml", "max_objets = 2\n");
  const CommandRun run = run_command({"check", broken});
  EXPECT_EQ(run.code, 1);
  EXPECT_THAT(run.error, HasSubstr("05-broken.toml:1"));
  EXPECT_THAT(run.error, HasSubstr("max_objects"));
  EXPECT_EQ(run_command({"check", folder / "none.toml"}).code, 2);
}

TEST(DescribePreset, PrintsAFileThatIsAPresetItself) {
  const TempFolder folder;
  const CommandRun printed = run_command({"describe-preset"});
  ASSERT_EQ(printed.code, 0);
  const CommandRun run =
      run_command({"check", write_text(folder / "07-printed.toml", printed.out)});
  EXPECT_EQ(run.code, 0) << run.error;
}

}  // namespace
}  // namespace grapnel
