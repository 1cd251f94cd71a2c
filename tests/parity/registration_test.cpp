// PCL's own expected numbers for registration: test/registration/test_registration.cpp, bun0 onto
// bun4.
#include <gtest/gtest.h>

#include <array>

#include "base/cloud_file.h"
#include "pipeline/preprocess/normals.h"
#include "pipeline/refine/closest_in_cells.h"
#include "pipeline/refine/fitness.h"
#include "pipeline/refine/generalized_icp.h"
#include "pipeline/refine/icp.h"
#include "pipeline/refine/plain_icp.h"
#include "tests/pipeline/support/surfaces.h"
#include "tests/support/recorded_data.h"

namespace grapnel {
namespace {

class PclRegistration : public testing::Test {
 protected:
  void SetUp() override {
    const std::filesystem::path source = test::recorded_data("pcl_test/bun0.pcd");
    if (source.empty()) GTEST_SKIP() << test::kNoRecordedData;
    source_ = std::make_unique<test::OwnedSurface>(test::surface_of(read_cloud(source)));
    target_ = std::make_unique<test::OwnedSurface>(
        test::surface_of(read_cloud(test::recorded_data("pcl_test/bun4.pcd"))));
    ASSERT_EQ((*source_)->size, 397U);
    ASSERT_EQ((*target_)->size, 361U);
    memory_ =
        std::make_unique<test::ArenaMemory>([&](Arena& arena) { cells_.reserve(arena, 400); });
    ASSERT_TRUE(cells_.build(**target_, 0.01).ok());
  }
  Surface& source() { return **source_; }
  Surface& target() { return **target_; }

  void estimate_normals(int k) {
    PcaNormalsParams params;
    params.k = k;
    PcaNormals normals(params);
    const test::ArenaMemory memory(
        [&](Arena& arena) { normals.reserve(arena, test::small_limits()); });
    for (Surface* surface : {&source(), &target()}) {
      surface->spacing_m = 0.005;
      ASSERT_TRUE(normals.estimate(*surface).ok());
    }
  }

  std::unique_ptr<test::OwnedSurface> source_, target_;
  std::unique_ptr<test::ArenaMemory> memory_;
  ClosestInCells cells_;
};

TEST_F(PclRegistration, IterativeClosestPointGivesTheListedMatrix) {
  PlainIcpParams params;
  params.max_iterations = 50;
  params.transformation_epsilon_m2 = 1e-8;
  params.min_rotation_cos = 1.0 - 1e-8;
  params.max_distance_m = 0.05;
  const Result<RefinedPose> found =
      PlainIcp(params).refine(source(), target(), cells_, Pose::Identity());
  ASSERT_TRUE(found.ok());
  constexpr std::array<std::array<double, 4>, 3> kExpected = {
      {{0.8806, 0.036481287330389023, -0.4724, 0.03453},
       {-0.02354, 0.9992, 0.03326, -0.001519},
       {0.4732, -0.01817, 0.8808, 0.04116}}};
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 4; ++column) {
      // PCL's own tolerances.
      EXPECT_NEAR(found.value().target_from_source.matrix()(row, column),
                  kExpected[static_cast<std::size_t>(row)][static_cast<std::size_t>(column)],
                  row == 0 && column == 1 ? 1e-2 : 1e-3)
          << row << ", " << column;
    }
  }
}

TEST_F(PclRegistration, PointToPlaneEndsBelowTheListedFitness) {
  estimate_normals(10);
  PlainIcpParams params;
  params.metric = PlainIcpParams::Metric::PointToPlane;
  params.max_iterations = 50;
  params.max_distance_m = 100.0;
  const Result<RefinedPose> found =
      PlainIcp(params).refine(source(), target(), cells_, Pose::Identity());
  ASSERT_TRUE(found.ok());
  EXPECT_LT(pcl_fitness_score(source(), target(), cells_, found.value().target_from_source, 100.0),
            0.001);
}

TEST_F(PclRegistration, GeneralizedEndsBelowTheListedFitness) {
  estimate_normals(20);
  GeneralizedIcpParams params;
  params.max_iterations = 50;
  params.max_distance_m = 0.05;
  const Result<RefinedPose> found =
      GeneralizedIcp(params).refine(source(), target(), cells_, Pose::Identity());
  ASSERT_TRUE(found.ok());
  EXPECT_LT(pcl_fitness_score(source(), target(), cells_, found.value().target_from_source, 100.0),
            0.0001);
}

TEST_F(PclRegistration, FastIcpEndsWhereThePlainOneDoes) {
  estimate_normals(10);
  target().spacing_m = 0.01;
  IcpParams fast;
  fast.max_iterations = 200;
  fast.start_distance_ratio = fast.end_distance_ratio = 500.0;  // 5 m: every weight is 1
  fast.max_normal_angle_rad = 3.2;
  fast.freeze_ratio = 0.0;
  fast.convergence_m = fast.convergence_rad = 1e-7;
  PlainIcpParams plain;
  plain.metric = PlainIcpParams::Metric::PointToPlane;
  plain.max_iterations = 200;
  plain.max_distance_m = 5.0;
  plain.transformation_epsilon_m2 = 1e-14;
  plain.min_rotation_cos = 1.0 - 1e-14;
  const Result<RefinedPose> a = Icp(fast).refine(source(), target(), cells_, Pose::Identity());
  const Result<RefinedPose> b =
      PlainIcp(plain).refine(source(), target(), cells_, Pose::Identity());
  ASSERT_TRUE(a.ok() && b.ok());
  // Single precision, over a bunny of 0.15 m whose normals fix every direction.
  EXPECT_LT(
      (a.value().target_from_source.translation() - b.value().target_from_source.translation())
          .norm(),
      5e-5);
  EXPECT_LT(rotation_angle_rad(a.value().target_from_source, b.value().target_from_source), 3e-4);
}

}  // namespace
}  // namespace grapnel
