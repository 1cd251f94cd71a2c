// Pairs of views of the PrimeSense bunny: poses_N.txt take the camera of view N to the object.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <filesystem>
#include <fstream>
#include <string>

#include "pipeline/registrar.h"
#include "tests/support/recorded_data.h"
#include "tests/support/temp_folder.h"
#include "workbench/input.h"
#include "workbench/surfaces.h"

namespace grapnel {
namespace {

using test::recorded_data;

/// The files' rotations are all scaled by the same 0.9966: only their quotients are rigid.
Mat4d object_from_camera(int view) {
  std::ifstream stream(
      recorded_data(("primesense_bunny/poses_" + std::to_string(view) + ".txt").c_str()));
  Mat4d matrix = Mat4d::Identity();
  for (int i = 0; i < 16; ++i) stream >> matrix(i / 4, i % 4);
  return matrix;
}

/// Depth image as the folder has it: millimetres, intrinsics of its README.
std::unique_ptr<StoredSurface> view_surface(int view, const std::filesystem::path& camera) {
  InputOptions options;
  options.camera = camera;
  const std::string name = "primesense_bunny/depth_" + std::to_string(view) + ".png";
  return make_surface(load_input(recorded_data(name.c_str()), options));
}

class PairRegistration : public testing::Test {
 protected:
  void SetUp() override {
    if (recorded_data("primesense_bunny").empty()) GTEST_SKIP() << test::kNoRecordedData;
    camera_ = folder_ / "camera.toml";
    std::ofstream(camera_) << "width = 640\nheight = 480\nfx = 542.0\nfy = 540.5\ncx = 320.0\n"
                              "cy = 240.0\nmetres_per_unit = 0.001\n";
    const std::filesystem::path root = GRAPNEL_SOURCE_DIR;
    registrar_ = Registrar::create(
        load_preset(root / "config/presets/02-pair.toml", root / "config/models"));
  }

  RegistrationReport register_views(int source, int target) {
    const auto from = view_surface(source, camera_);
    const auto to = view_surface(target, camera_);
    const auto answer = registrar_->register_pair(from->surface, to->surface, {});
    EXPECT_TRUE(answer.ok());
    return answer.ok() && !answer.value().objects.empty() ? answer.value().objects[0]
                                                          : RegistrationReport{};
  }

  /// Mean of a view's points.
  Vec3d middle_of(int view) {
    const auto points = view_surface(view, camera_);
    Vec3d sum = Vec3d::Zero();
    for (std::size_t i = 0; i < points->surface.size; ++i) {
      sum += points->surface.point(i).cast<double>();
    }
    return sum / static_cast<double>(points->surface.size);
  }

  test::TempFolder folder_;
  std::filesystem::path camera_;
  std::unique_ptr<Registrar> registrar_;
};

// The folder's README: neighbouring views fit to under 1 mm after the given poses.
constexpr double kTolerance_m = 0.003;
constexpr double kTolerance_rad = 0.035;

TEST_F(PairRegistration, BringsViewsTwentyDegreesApartTogether) {
  for (const int source : {0, 4, 7, 11, 14}) {
    const int target = source + 2;
    const RegistrationReport report = register_views(source, target);
    const Pose truth(Mat4d(object_from_camera(target).inverse() * object_from_camera(source)));
    const Vec3d middle = middle_of(source);
    EXPECT_TRUE(report.accepted) << source;
    EXPECT_LT((report.target_from_source * middle - truth * middle).norm(), kTolerance_m) << source;
    EXPECT_LT(rotation_angle_rad(report.target_from_source, truth), kTolerance_rad) << source;
  }
}

TEST_F(PairRegistration, AcceptsNoPoseOfViewsThatShareNextToNothing) {
  for (const int source : {0, 3, 8}) {
    const RegistrationReport report = register_views(source, source + 9);
    EXPECT_FALSE(report.accepted) << source;
    EXPECT_FALSE(report.reasons.empty());
  }
}

TEST_F(PairRegistration, GivesTheSameBitsTwice) {
  const RegistrationReport first = register_views(2, 3);
  const RegistrationReport second = register_views(2, 3);
  EXPECT_EQ(first.target_from_source.matrix(), second.target_from_source.matrix());
  EXPECT_EQ(first.fitness, second.fitness);
  EXPECT_EQ(first.margin, second.margin);
}

}  // namespace
}  // namespace grapnel
