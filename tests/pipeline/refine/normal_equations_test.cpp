#include "pipeline/refine/normal_equations.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>

#include "base/rng.h"

namespace grapnel {
namespace {

Vec3d random_vector(Rng& rng) {
  return {rng.uniform(-1, 1), rng.uniform(-1, 1), rng.uniform(-1, 1)};
}

TEST(NormalEquations, TheirJacobianIsTheNumericOne) {
  Rng rng(2);
  for (int round = 0; round < 20; ++round) {
    const Vec3d direction = random_vector(rng);
    const Vec3d x = random_vector(rng);
    NormalEquations equations(Vec3d::Zero());
    equations.add(direction, x, 0.0, 1.0);
    const Mat6d information = equations.information_at_origin();
    Vec6d jacobian;
    constexpr double kStep = 1e-6;
    for (int i = 0; i < 6; ++i) {
      Vec6d step = Vec6d::Zero();
      step[i] = kStep;
      const Vec3d plus = moved(Pose::Identity(), step, Vec3d::Zero()) * x;
      const Vec3d minus = moved(Pose::Identity(), -step, Vec3d::Zero()) * x;
      jacobian[i] = direction.dot(plus - minus) / (2.0 * kStep);
    }
    // Central differences leave an error of the order of the step squared.
    EXPECT_LT((information - jacobian * jacobian.transpose()).cwiseAbs().maxCoeff(), 1e-8);
  }
}

TEST(NormalEquations, OneStepUndoesASmallMotion) {
  Rng rng(3);
  Vec6d motion;
  motion << 1e-4, -2e-4, 3e-4, 2e-4, 1e-4, -1e-4;
  const Vec3d centre(0.2, 0.1, 1.0);
  NormalEquations equations(centre);
  for (int i = 0; i < 50; ++i) {
    const Vec3d x = centre + random_vector(rng);
    const Vec3d direction = random_vector(rng).normalized();
    const Vec3d displaced = moved(Pose::Identity(), motion, centre) * x;
    equations.add(direction, displaced, direction.dot(displaced - x), 1.0);
  }
  // Second-order terms of a motion of 3e-4.
  EXPECT_LT((equations.solve(1e-9) + motion).cwiseAbs().maxCoeff(), 1e-6);
}

TEST(NormalEquations, PointsTowardASurfaceOfAnotherFrameAreTheSurfaceTowardThePoints) {
  Rng rng(6);
  const Mat3d rotation = rotation_from_vector(random_vector(rng));
  const Vec3d shift = random_vector(rng);
  const Vec3d centre = random_vector(rng);
  NormalEquations own(rotation * centre + shift);
  NormalEquations of_points(centre);
  for (int i = 0; i < 40; ++i) {
    const Vec3d point = centre + random_vector(rng);
    const Vec3d normal = random_vector(rng).normalized();
    const double off_m = 0.01 * rng.uniform(-1.0, 1.0);
    const double weight = rng.uniform(0.1, 1.0);
    of_points.add(normal, point, off_m, weight);
    own.add(rotation * normal, rotation * point + shift, -off_m, weight);
  }
  NormalEquations sum(rotation * centre + shift);
  sum.add_opposite(of_points, rotation);
  // Rounding of a product of 6 x 6 matrices.
  EXPECT_LT((sum.solve(1e-9) - own.solve(1e-9)).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_LT((sum.information_at_origin() - own.information_at_origin()).cwiseAbs().maxCoeff(),
            1e-9 * own.information_at_origin().cwiseAbs().maxCoeff());
  EXPECT_NEAR(sum.weight(), own.weight(), 1e-12);
}

TEST(NormalEquations, WhatAPlaneDoesNotFixStays) {
  Rng rng(4);
  NormalEquations equations(Vec3d::Zero());
  for (int i = 0; i < 100; ++i) {
    const Vec3d x(rng.uniform(-1, 1), rng.uniform(-1, 1), 0.0);
    equations.add(Vec3d::UnitZ(), x, 0.01 + 0.02 * x.x(), 1.0);
  }
  const Vec6d step = equations.solve(0.003);
  EXPECT_NEAR(step[2], -0.01, 1e-9);
  EXPECT_NEAR(step[4], 0.02, 1e-9);  // about y: z falls by 0.02 x
  EXPECT_NEAR(step[0], 0.0, 1e-12);
  EXPECT_NEAR(step[1], 0.0, 1e-12);
  EXPECT_NEAR(step[5], 0.0, 1e-12);
}

TEST(NormalEquations, InformationOfTheInverseIsThatOfThePerturbationSeenFromTheOtherFrame) {
  Rng rng(5);
  Pose pose = Pose::Identity();
  pose.linear() = rotation_from_vector(random_vector(rng));
  pose.translation() = random_vector(rng);
  // exp(ξ) T, inverted, is exp(ξ') T⁻¹; both must cost the same.
  Mat6d root = Mat6d::Random();
  const Mat6d information = root * root.transpose();
  const Mat6d inverse = information_of_inverse(information, pose);
  Vec6d step;
  step << 1e-5, 2e-5, -1e-5, 3e-5, -2e-5, 1e-5;
  const Pose perturbed = moved(pose, step, Vec3d::Zero());
  const Pose delta = perturbed.inverse() * pose;
  Vec6d other;
  other.head<3>() = delta.translation();
  other.tail<3>() = vector_from_rotation(delta.linear());
  const double own_cost = step.dot(information * step);
  EXPECT_NEAR(other.dot(inverse * other) / own_cost, 1.0, 1e-3);
}

}  // namespace
}  // namespace grapnel
