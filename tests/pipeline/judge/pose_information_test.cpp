// The information that the judge's own pixels hold about a pose.
#include "pipeline/judge/pose_information.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <vector>

#include "tests/pipeline/support/box_scene.h"

namespace grapnel {
namespace {

constexpr int kWidth = 320;
constexpr int kHeight = 240;
constexpr double kFocal_px = 280.0;
constexpr double kBelt_m = 1.1;
constexpr double kTop_m = 0.9;
const Vec3d kSize_m = {0.4, 0.3, 0.2};

class PoseInformation : public testing::Test {
 protected:
  PoseInformation()
      : scene_(kWidth, kHeight, kFocal_px, kBelt_m),
        pose_(test::lying(kSize_m, kBelt_m, 0.0, 0.0, 0.0)),
        model_(test::surface_of(test::box_cloud(kSize_m, 0.005))),
        memory_([&](Arena& arena) {
          edges_.reserve(arena, kWidth * kHeight);
          render_.reserve(arena, kWidth * kHeight, 4096);
        }) {
    model_->spacing_m = 0.005;
    scene_.add(pose_, kSize_m);
    spread_.shared_px = 1.0;
    spread_.floor_m = 0.004;
  }

  /// With the readings' edges or, for the surface alone, without.
  Mat6d information(bool with_outline) { return readings(with_outline).information; }
  PoseReadings readings(bool with_outline) {
    view_ = {};
    view_.intrinsics = scene_.frame().intrinsics;
    view_.depth = scene_.frame().depth;
    view_.metres_per_unit = static_cast<float>(scene_.frame().metres_per_unit);
    label_.assign(kWidth * kHeight, 0);
    for (std::size_t i = 0; i < label_.size(); ++i) {
      const double z = scene_.pixels().counts[i] * scene_.frame().metres_per_unit;
      label_[i] = z > 0.0 && z < kBelt_m - 0.01 ? 1 : 0;
    }
    view_.label = {label_.data(), kWidth, kHeight};
    view_.object = 1;
    view_.box = {0, 0, kWidth, kHeight};
    render_.render(*model_, pose_, view_);
    edges_.build(view_);
    if (with_outline) render_.find_contour(*model_, pose_, view_);
    return pose_information(*model_, pose_, render_, view_, edges_, spread_);
  }

  test::BoxScene scene_;
  Pose pose_;
  test::OwnedSurface model_;
  EdgeMap edges_;
  ModelRender render_;
  test::ArenaMemory memory_;
  std::vector<std::uint8_t> label_;
  DepthView view_;
  ReadingSpread spread_;
};

TEST_F(PoseInformation, OfAFaceAcrossTheViewIsThatOfTheMeanOfItsReadings) {
  const Mat6d information = this->information(false);
  // The top's pixels but for the rim of three that discs and mixed pixels blur: N readings of z.
  const double width_px = 0.4 * kFocal_px / kTop_m - 6.0;
  const double height_px = 0.3 * kFocal_px / kTop_m - 6.0;
  const double sigma_m = 1.425e-3 * kTop_m * kTop_m;
  const double readings = width_px * height_px;
  EXPECT_NEAR(information(2, 2) * sigma_m * sigma_m / readings, 1.0, 0.1);
  // Turned about x it moves by y: the second moment of an even width of h is h²/12.
  const double arm_m = height_px * kTop_m / kFocal_px;
  EXPECT_NEAR(information(3, 3) / information(2, 2) / (arm_m * arm_m / 12.0), 1.0, 0.1);
  // Along the face, and about its normal, only slivers of the sides say something.
  EXPECT_LT(information(0, 0), 0.05 * information(2, 2));
}

TEST_F(PoseInformation, OfTheOutlineIsThatOfItsTwoSides) {
  const Mat6d with = information(true);
  const Mat6d without = information(false);
  // Two sides of 0.3 m are met by edges across x, each point good to a pixel and its rounding.
  const double points = 2.0 * 0.3 * kFocal_px / kTop_m;
  const double pixel_m = kTop_m / kFocal_px;
  const double expected = points / ((1.0 + 1.0 / 12.0) * pixel_m * pixel_m);
  EXPECT_NEAR((with(0, 0) - without(0, 0)) / expected, 1.0, 0.15);
}

TEST_F(PoseInformation, FallsAsReadingsShareTheirErrors) {
  const Mat6d alone = information(false);
  spread_.shared_px = 20.0;
  const Mat6d shared = information(false);
  EXPECT_NEAR(alone(2, 2) / shared(2, 2), 20.0, 1e-6);
}

TEST_F(PoseInformation, IsNoneOfWhatLiesElsewhere) {
  pose_.translation().z() -= 0.05;
  EXPECT_LT(information(false)(2, 2), 1.0);
}

TEST_F(PoseInformation, TheMisfitLeadsBackToThePoseThatTheReadingsFit) {
  const Vec3d off_m(0.0, 0.0, 0.001);
  pose_.translation() += off_m;
  const PoseReadings found = readings(true);
  const Vec6d back = found.information.inverse() * found.misfit;
  const Vec3d top(0.0, 0.0, kTop_m);
  const Vec3d at_top = back.head<3>() + Vec3d(back.tail<3>()).cross(top);
  // Depths are whole millimetres.
  EXPECT_NEAR(at_top.z(), -off_m.z(), 0.0002);
}

TEST_F(PoseInformation, ACommonErrorShiftsThePoseAsFarAsItsReadingsPlaceIt) {
  const PoseReadings found = readings(true);
  const Eigen::Matrix<double, 6, 3> shift = found.information.inverse() * found.common;
  const Vec3d top(0.0, 0.0, kTop_m);
  const auto at_top = [&](int column) {
    return Vec3d(shift.col(column).head<3>() + Vec3d(shift.col(column).tail<3>()).cross(top));
  };
  // The outline alone places the top across the view, one pixel for one pixel but for the slivers
  // of the sides; its readings alone place it along the view.
  const double pixel_m = kTop_m / kFocal_px;
  EXPECT_NEAR(at_top(0).x() / pixel_m, 1.0, 0.1);
  EXPECT_NEAR(at_top(1).y() / pixel_m, 1.0, 0.1);
  EXPECT_NEAR(at_top(2).z() / (1.425e-3 * kTop_m * kTop_m), 1.0, 0.02);
  EXPECT_NEAR(at_top(2).x() / pixel_m, 0.0, 0.05);
}

/// Variance along the view, of the point where the view's axis meets the top, that rounding makes,
/// in squares of a unit.
double rounding_variance(const PoseReadings& found, double top_m, double unit_m) {
  const Mat6d inverse = found.information.inverse();
  const Mat6d covariance = inverse * found.rounding * inverse;
  Vec6d at_top = Vec6d::Zero();
  at_top[2] = 1.0;
  at_top.tail<3>() = Vec3d(0.0, 0.0, top_m).cross(Vec3d::UnitZ());
  return at_top.dot(covariance * at_top) / (unit_m * unit_m);
}

TEST_F(PoseInformation, OneRoundingOfALevelFaceShiftsItAsAWhole) {
  const PoseReadings found = readings(true);
  // All of the top has one depth: an error that is even over one unit.
  const double unit_m = scene_.frame().metres_per_unit;
  EXPECT_NEAR(rounding_variance(found, kTop_m, unit_m), 1.0 / 12.0, 0.005);
}

TEST_F(PoseInformation, RoundingsOfATiltedFaceAverageOut) {
  Pose tilt = Pose::Identity();
  tilt.linear() = rotation_from_vector({0.1, 0.0, 0.0});
  pose_ = Eigen::Translation3d(0.0, 0.0, kTop_m - 0.1) * tilt *
          Eigen::Translation3d(0.0, 0.0, -kTop_m) * pose_;
  scene_.add(pose_, kSize_m);
  const PoseReadings found = readings(true);
  // Some 30 values in stripes across the slope.
  const double unit_m = scene_.frame().metres_per_unit;
  const double variance = rounding_variance(found, kTop_m - 0.1, unit_m);
  EXPECT_GT(variance, 0.0);
  EXPECT_LT(variance, 0.1 / 12.0);
  // Stripes along x say less of a turn about x than of one about y.
  const Mat6d inverse = found.information.inverse();
  const Mat6d covariance = inverse * found.rounding * inverse;
  EXPECT_GT(covariance(3, 3), 4.0 * covariance(4, 4));
}

}  // namespace
}  // namespace grapnel
