#include "pipeline/judge/motion_share.h"

#include <gtest/gtest.h>

#include "base/geometry.h"

namespace grapnel {
namespace {

/// Floor of 30 × 30 points across z, and on its middle a wall of 10 × 10 points that faces along x.
/// Of the wall's points every `wall_period`-th counts as matched, in each of its rows.
struct FloorAndWall {
  MotionSums matched{Vec3d::Zero(), 1.0};
  MotionSums all{Vec3d::Zero(), 1.0};
  double matched_points = 0.0;
  double points = 0.0;

  explicit FloorAndWall(int wall_period) {
    for (int i = 0; i < 900; ++i) {
      add(Vec3f(-1.45F + 0.1F * static_cast<float>(i % 30),
                -1.45F + 0.1F * static_cast<float>(i / 30), 0.0F),
          Vec3f::UnitZ(), true);
    }
    for (int i = 0; i < 100; ++i) {
      const Vec3f place(0.0F, -0.45F + 0.1F * static_cast<float>(i / 10),
                        0.1F * static_cast<float>(i / 10));
      add(place, Vec3f::UnitX(), i % wall_period == 0);
    }
  }

 private:
  void add(const Vec3f& place, const Vec3f& normal, bool match) {
    all.add(place, normal);
    points += 1.0;
    if (!match) return;
    matched.add(place, normal);
    matched_points += 1.0;
  }
};

TEST(MotionShare, IsOneWhereEverythingMatches) {
  const FloorAndWall scene(1);
  EXPECT_NEAR(least_matched_share(scene.matched, scene.all), 1.0, 1e-9);
}

// Half of the wall matches, every place of it alike. Along x the wall's 100 points notice, of which
// 50 match, and 2 % of the 900 that notice a motion along z are added to both: 68 of 118. Turns
// about z are noticed by the wall alone, too; no motion can have less than the half.
TEST(MotionShare, IsThatOfTheWallWhereOnlyTheWallNoticesAMotion) {
  const FloorAndWall scene(2);
  EXPECT_GT(scene.matched_points / scene.points, 0.94);
  const double share = least_matched_share(scene.matched, scene.all);
  EXPECT_GT(share, 0.5);
  EXPECT_LE(share, 68.0 / 118.0 + 1e-6);
}

// The floor alone: what nobody notices is not held against the match.
TEST(MotionShare, SaysNothingOfMotionsThatNothingNotices) {
  MotionSums floor(Vec3d::Zero(), 1.0);
  for (int i = 0; i < 100; ++i) {
    floor.add(Vec3f(0.1F * static_cast<float>(i % 10), 0.1F * static_cast<float>(i / 10), 0.0F),
              Vec3f::UnitZ());
  }
  EXPECT_NEAR(least_matched_share(floor, floor), 1.0, 1e-9);
}

TEST(MotionShare, IsZeroOfNothing) {
  const MotionSums none(Vec3d::Zero(), 1.0);
  EXPECT_EQ(least_matched_share(none, none), 0.0);
}

// Turns are measured one arm away: the unit of length makes no difference.
TEST(MotionShare, DoesNotDependOnTheScale) {
  const FloorAndWall scene(3);
  MotionSums matched(Vec3d::Zero(), 1e-3);
  MotionSums all(Vec3d::Zero(), 1e-3);
  for (int i = 0; i < 1000; ++i) {
    const bool floor = i < 900;
    const int k = floor ? i : i - 900;
    const Vec3f place = floor ? Vec3f(-1.45F + 0.1F * static_cast<float>(k % 30),
                                      -1.45F + 0.1F * static_cast<float>(k / 30), 0.0F)
                              : Vec3f(0.0F, -0.45F + 0.1F * static_cast<float>(k / 10),
                                      0.1F * static_cast<float>(k / 10));
    const Vec3f normal = floor ? Vec3f::UnitZ() : Vec3f::UnitX();
    all.add(1e-3F * place, normal);
    if (floor || k % 3 == 0) matched.add(1e-3F * place, normal);
  }
  EXPECT_NEAR(least_matched_share(matched, all), least_matched_share(scene.matched, scene.all),
              1e-5);  // single precision of the places
}

}  // namespace
}  // namespace grapnel
