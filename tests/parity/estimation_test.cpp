// PCL's own numbers for poses from given pairs, test_registration_api.cpp, and for the score of a
// pose, test_registration.cpp.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <vector>

#include "base/cloud_file.h"
#include "pipeline/coarse/generators.h"
#include "pipeline/refine/closest_in_cells.h"
#include "pipeline/refine/fitness.h"
#include "pipeline/refine/icp.h"
#include "pipeline/refine/plain_icp.h"
#include "tests/pipeline/support/surfaces.h"
#include "tests/support/recorded_data.h"

namespace grapnel {
namespace {

/// TransformationEstimationSVD, …EIG, …DualQuaternion and …LM: R_ref and t_ref.
Pose reference_pose() {
  Pose pose = Pose::Identity();
  pose.linear() = Eigen::Quaterniond(0.9, 0.1, -0.25, 0.15).normalized().toRotationMatrix();
  pose.translation() = Vec3d(0.5, -2.0, 1.0);
  return pose;
}

// All of them minimise the same sum, which has one closed-form minimum: one method stands for all,
// at the tightest of their tolerances.
TEST(PclTransformationEstimation, ClosedFormRecoversTheReference) {
  const std::filesystem::path file = test::recorded_data("pcl_test/bun4.pcd");
  if (file.empty()) GTEST_SKIP() << test::kNoRecordedData;
  test::OwnedSurface source = test::surface_of(read_cloud(file));
  test::OwnedSurface target = test::surface_of(read_cloud(file));
  test::move(*target, reference_pose());
  std::vector<Keypoint> keypoints;
  std::vector<Correspondence> storage(source->size);
  Correspondences pairs{std::span<Correspondence>(storage)};
  for (std::int32_t i = 0; i < static_cast<std::int32_t>(source->size); ++i) {
    keypoints.push_back({i, 1.0F, 0.0F});
    pairs.push_back({i, i, 0.0F});
  }
  std::vector<Hypothesis> found(1);
  Hypotheses hypotheses{std::span<Hypothesis>(found)};
  Rng rng(1);
  SvdGenerator svd(SvdParams{0.01, 2.5});
  ASSERT_TRUE(
      svd.generate({&*source, &*target, keypoints, keypoints}, pairs, rng, hypotheses).ok());
  const Eigen::Quaterniond expected(reference_pose().linear());
  Eigen::Quaterniond turn(hypotheses[0].target_from_source.linear());
  if (turn.dot(expected) < 0.0) turn.coeffs() = -turn.coeffs();
  EXPECT_LT((turn.coeffs() - expected.coeffs()).cwiseAbs().maxCoeff(), 1e-6);
  EXPECT_LT((hypotheses[0].target_from_source.translation() - reference_pose().translation())
                .cwiseAbs()
                .maxCoeff(),
            1e-6);
}

/// TransformationEstimationPointToPlaneLLS, …PointToPlane and …SymmetricPointToPlaneLLS: a sheet of
/// 21 × 21 points and its copy.
struct Sheet {
  test::OwnedSurface source{441, 0};
  test::OwnedSurface target{441, 0};
  Pose truth = Pose::Identity();

  Sheet() {
    truth.matrix() << 0.9938, 0.0988, 0.0517, 0.1, -0.0997, 0.9949, 0.0149, -0.2, -0.05, -0.02,
        0.9986, 0.3, 0.0, 0.0, 0.0, 1.0;
    for (Surface* surface : {&*source, &*target}) {
      surface->spacing_m = 0.5;
      for (int column = 0; column < 21; ++column) {
        for (int row = 0; row < 21; ++row) {
          const double x = -5.0 + 0.5 * column;
          const double y = -5.0 + 0.5 * row;
          const Vec3d n = Vec3d(-0.2 * x - 0.2, 0.6 * y - 0.2, 1.0).normalized();
          const std::size_t i = surface->size++;
          surface->x[i] = static_cast<float>(x);
          surface->y[i] = static_cast<float>(y);
          surface->z[i] = static_cast<float>(0.1 * x * x + 0.2 * x * y - 0.3 * y + 1.0);
          surface->nx[i] = static_cast<float>(n.x());
          surface->ny[i] = static_cast<float>(n.y());
          surface->nz[i] = static_cast<float>(n.z());
        }
      }
    }
    test::move(*target, truth);
  }
};

/// Pairs point i with point i: a refiner asks in the order of the points.
class SameIndex final : public ClosestSurface {
 public:
  explicit SameIndex(std::size_t size) : size_(size) {}
  [[nodiscard]] std::int32_t closest(const Vec3f&, float) const noexcept override {
    return static_cast<std::int32_t>(next_++ % size_);
  }

 private:
  std::size_t size_;
  mutable std::size_t next_ = 0;
};

void expect_truth(const Sheet& sheet, const Pose& found, double tolerance) {
  EXPECT_LT((found.matrix() - sheet.truth.matrix()).cwiseAbs().maxCoeff(), tolerance);
}

IcpParams with_given_pairs(IcpParams::Metric metric, int iterations) {
  IcpParams params;
  params.metric = metric;
  params.max_iterations = iterations;
  params.max_points = 441;
  params.start_distance_ratio = params.end_distance_ratio = 1000.0;  // every weight is 1
  params.max_normal_angle_rad = 3.2;
  params.freeze_ratio = 0.0;
  params.convergence_m = params.convergence_rad = 1e-7;
  return params;
}

TEST(PclTransformationEstimation, OneLinearStepPointToPlaneRecoversTheReference) {
  Sheet sheet;
  PlainIcpParams params;
  params.metric = PlainIcpParams::Metric::PointToPlane;
  params.max_iterations = 1;
  params.max_distance_m = 100.0;
  const auto plain =
      PlainIcp(params).refine(*sheet.source, *sheet.target, SameIndex(441), Pose::Identity());
  ASSERT_TRUE(plain.ok());
  expect_truth(sheet, plain.value().target_from_source, 1e-2);
}

TEST(PclTransformationEstimation, RepeatedPointToPlaneRecoversTheReference) {
  Sheet sheet;
  const auto found = Icp(with_given_pairs(IcpParams::Metric::PointToPlane, 20))
                         .refine(*sheet.source, *sheet.target, SameIndex(441), Pose::Identity());
  ASSERT_TRUE(found.ok());
  expect_truth(sheet, found.value().target_from_source, 1e-3);
}

TEST(PclTransformationEstimation, SymmetricPointToPlaneRecoversTheReference) {
  Sheet sheet;
  const auto found = Icp(with_given_pairs(IcpParams::Metric::Symmetric, 20))
                         .refine(*sheet.source, *sheet.target, SameIndex(441), Pose::Identity());
  ASSERT_TRUE(found.ok());
  expect_truth(sheet, found.value().target_from_source, 1e-2);
}

// getFitnessScore: points a quarter of a metre from their partners.
TEST(PclFitnessScore, IsTheMeanSquaredDistance) {
  test::OwnedSurface source(10, 0);
  test::OwnedSurface target(10, 0);
  for (Surface* surface : {&*source, &*target}) {
    surface->size = 10;
    for (std::size_t i = 0; i < 10; ++i) surface->x[i] = static_cast<float>(i);
  }
  for (std::size_t i = 0; i < 10; ++i) target->y[i] = 0.25F;
  ClosestInCells cells;
  const test::ArenaMemory memory([&](Arena& arena) { cells.reserve(arena, 10); });
  ASSERT_TRUE(cells.build(*target, 0.5).ok());
  EXPECT_DOUBLE_EQ(pcl_fitness_score(*source, *target, cells, Pose::Identity(), 100.0), 0.0625);
  // The limit is compared with the square: 0.06 excludes what 0.07 includes.
  EXPECT_DOUBLE_EQ(pcl_fitness_score(*source, *target, cells, Pose::Identity(), 0.07), 0.0625);
  EXPECT_TRUE(std::isinf(pcl_fitness_score(*source, *target, cells, Pose::Identity(), 0.06)));
}

}  // namespace
}  // namespace grapnel
