#include "workbench/evaluate/consistency.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace grapnel {
namespace {

const std::vector<Vec3f> kPoints = {{0.9f, 0.0f, 0.0f}, {1.1f, 0.0f, 0.0f}};  // centre 1 0 0

Mat6d diagonal(double translation, double rotation) {
  Mat6d covariance = Mat6d::Zero();
  covariance.diagonal() << translation, translation, translation, rotation, rotation, rotation;
  return covariance;
}

TEST(Consistency, IsOneForAnErrorOfOneDeviation) {
  Pose truth = Pose::Identity();
  truth.translation() = Vec3d(0.002, 0.0, 0.0);
  const auto nees =
      normalised_squared_errors(Pose::Identity(), truth, diagonal(4e-6, 0.0), Symmetry::None, {});
  EXPECT_NEAR(nees[0], 1.0, 1e-12);
}

TEST(Consistency, MovesTheErrorToTheCentreOfThePoints) {
  // A turn by a milliradian about z displaces the centre, a metre along x, by a millimetre along y.
  Pose truth = Pose::Identity();
  truth.linear() = rotation_from_vector(Vec3d(0.0, 0.0, 1e-3));
  const auto nees = normalised_squared_errors(Pose::Identity(), truth, diagonal(0.0, 4e-6),
                                              Symmetry::None, kPoints);
  EXPECT_NEAR(nees[1], 0.25, 1e-6);  // variance there: (1 m)² · 4e-6
  EXPECT_NEAR(nees[5], 0.25, 1e-6);
  EXPECT_NEAR(nees[3], 0.0, 1e-12);
}

TEST(Consistency, IsSeenAlongTheSourcesAxes) {
  Pose found = Pose::Identity();
  found.linear() = rotation_from_vector(Vec3d(0.0, 0.0, std::acos(-1.0) / 2.0));  // its x is our y
  Pose truth = found;
  truth.translation() = Vec3d(0.0, 0.001, 0.0);
  const auto nees =
      normalised_squared_errors(found, truth, diagonal(1e-6, 1e-6), Symmetry::None, {});
  EXPECT_NEAR(nees[0], 1.0, 1e-9);
  EXPECT_NEAR(nees[1], 0.0, 1e-9);
}

TEST(Consistency, LeavesOutAnAxisThatIsFree) {
  const auto nees = normalised_squared_errors(Pose::Identity(), Pose::Identity(),
                                              diagonal(1.0, 1.0), Symmetry::AxisZFlip, kPoints);
  EXPECT_TRUE(std::isnan(nees[5]));
  EXPECT_EQ(nees[4], 0.0);
}

}  // namespace
}  // namespace grapnel
