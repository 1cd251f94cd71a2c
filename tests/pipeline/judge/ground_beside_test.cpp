// What lies beside a pose's outline: the only thing that says how high a part is whose sides are
// not in sight.
#include "pipeline/judge/ground_beside.h"

#include <gtest/gtest.h>

#include <vector>

#include "pipeline/judge/resting.h"
#include "tests/pipeline/support/box_scene.h"

namespace grapnel {
namespace {

constexpr int kWidth = 320;
constexpr int kHeight = 240;
constexpr double kFocal_px = 280.0;
constexpr double kBelt_m = 1.1;
constexpr double kTolerance_m = 0.005;
const Vec3d kSize_m = {0.2, 0.15, 0.1};

class Ground : public testing::Test {
 protected:
  Ground()
      : scene_(kWidth, kHeight, kFocal_px, kBelt_m),
        model_(test::surface_of(test::box_cloud(kSize_m, 0.005))),
        memory_([&](Arena& arena) {
          edges_.reserve(arena, kWidth * kHeight);
          render_.reserve(arena, kWidth * kHeight, 4096);
          search_.reserve(arena, 4096);
        }) {
    model_->spacing_m = 0.005;
    belt_.normal = {0.0, 0.0, -1.0};
    belt_.offset_m = kBelt_m;
  }

  /// A taught box at a pose; what is in the scene is another matter.
  GroundBeside look(const Pose& pose) {
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
    view_.belt = &belt_;
    view_.box = {0, 0, kWidth, kHeight};
    edges_.build(view_);
    render_.render(*model_, pose, view_);
    render_.find_contour(*model_, pose, view_);
    resting_ = rest_on(belt_, *model_, pose, Vec3d::Zero(), kSize_m.norm());
    return search_.look(*model_, pose, render_, view_, edges_, resting_.lowest_m,
                        resting_.highest_m, kTolerance_m);
  }

  /// A box whose lower side is `gap_m` above the belt.
  void put(const Vec3d& size_m, double x_m, double gap_m) {
    scene_.add(test::lying(size_m, kBelt_m - gap_m, x_m, 0.0, 0.3), size_m);
  }
  static Pose taught(double x_m, double gap_m) {
    return test::lying(kSize_m, kBelt_m - gap_m, x_m, 0.0, 0.3);
  }

  test::BoxScene scene_;
  test::OwnedSurface model_;
  DepthPlane belt_;
  EdgeMap edges_;
  ModelRender render_;
  GroundSearch search_;
  test::ArenaMemory memory_;
  std::vector<std::uint8_t> label_;
  DepthView view_;
  Resting resting_;
};

TEST_F(Ground, IsTheBeltAroundABoxThatStandsOnIt) {
  for (const double x_m : {0.0, 0.3}) {
    scene_ = test::BoxScene(kWidth, kHeight, kFocal_px, kBelt_m);
    put(kSize_m, x_m, 0.0);
    const GroundBeside ground = look(taught(x_m, 0.0));
    EXPECT_NEAR(ground.level_m, 0.0, 1e-3);
    EXPECT_GT(ground.share, 0.95);
    EXPECT_EQ(ground.borne, 0.0);
    EXPECT_NEAR(resting_.lowest_m, 0.0, 1e-6);
  }
}

TEST_F(Ground, IsTheBeltBelowTheTopOfAHigherBox) {
  for (const double x_m : {0.0, 0.1, 0.3}) {
    scene_ = test::BoxScene(kWidth, kHeight, kFocal_px, kBelt_m);
    put({kSize_m.x(), kSize_m.y(), 0.25}, x_m, 0.0);
    const GroundBeside ground = look(taught(x_m, 0.15));
    EXPECT_NEAR(ground.level_m, 0.0, 1e-3);
    EXPECT_GT(ground.share, 0.5) << x_m;
    EXPECT_LT(ground.borne, 0.1) << x_m;
    EXPECT_NEAR(resting_.lowest_m, 0.15, 1e-6);
  }
}

TEST_F(Ground, IsThePlateThatALowerBoxStandsOn) {
  put({0.7, 0.6, 0.013}, 0.0, 0.0);
  put({kSize_m.x(), kSize_m.y(), 0.087}, 0.0, 0.013);
  const GroundBeside ground = look(taught(0.0, 0.0));
  EXPECT_NEAR(ground.level_m, 0.013, 1e-3);
  EXPECT_GT(ground.share, 0.95);
}

TEST_F(Ground, IsSeenBelowABoxThatHangs) {
  put(kSize_m, 0.34, 0.2);
  const GroundBeside ground = look(taught(0.34, 0.2));
  EXPECT_NEAR(ground.level_m, 0.0, 1e-3);
  EXPECT_GT(ground.borne, 0.1);
}

TEST_F(Ground, ABoxOnWhatSticksOutBelowItIsBorne) {
  // A beam under its middle, seen at two sides.
  put({0.5, 0.05, 0.1}, 0.0, 0.0);
  put(kSize_m, 0.0, 0.1);
  const GroundBeside ground = look(taught(0.0, 0.1));
  EXPECT_NEAR(ground.level_m, 0.0, 1e-3);
  EXPECT_GT(ground.borne, 0.1);
}

TEST_F(Ground, WithoutABeltNothingIsKnown) {
  put(kSize_m, 0.0, 0.0);
  look(taught(0.0, 0.0));
  view_.belt = nullptr;
  const GroundBeside ground =
      search_.look(*model_, taught(0.0, 0.0), render_, view_, edges_, 0.0, 0.2, kTolerance_m);
  EXPECT_EQ(ground.share, 0.0);
}

}  // namespace
}  // namespace grapnel
