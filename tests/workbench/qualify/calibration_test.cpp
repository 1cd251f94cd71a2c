#include "workbench/qualify/calibration.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

namespace grapnel {
namespace {

std::size_t index_of(std::string_view check) {
  const auto found = std::find_if(kLimitedChecks.begin(), kLimitedChecks.end(),
                                  [&](const LimitedCheck& c) { return c.check == check; });
  return static_cast<std::size_t>(found - kLimitedChecks.begin());
}

LabelledPose pose(const std::string& id, bool right, double matched, double seen_through,
                  double margin) {
  LabelledPose made;
  made.id = id;
  made.right = right;
  made.measured[index_of("matched_share")] = matched;
  made.measured[index_of("seen_through")] = seen_through;
  made.measured[index_of("margin")] = margin;
  return made;
}

std::vector<LabelledPose> right_poses() {
  std::vector<LabelledPose> poses;
  for (int i = 0; i < 21; ++i) {
    poses.push_back(pose("right", true, 0.95 + 0.002 * i, 0.0005 * i, 0.8 + 0.01 * i));
  }
  return poses;
}

TEST(Calibration, LeavesRightPosesTheRoomFromTheirMedianToTheirWorst) {
  const Calibration found = calibrate(right_poses());
  const CheckLimit& matched = found.limits[index_of("matched_share")];
  EXPECT_DOUBLE_EQ(matched.worst_right, 0.95);
  EXPECT_NEAR(matched.limit, 0.93, 1e-12);
  EXPECT_NEAR(found.limits[index_of("seen_through")].limit, 0.015, 1e-12);
  EXPECT_NEAR(found.limits[index_of("margin")].limit, 0.7, 1e-12);
  EXPECT_FALSE(found.limits[index_of("unknown")].set);
}

TEST(Calibration, DrawsInTheCheckThatSetsAWrongPoseFarthestApart) {
  std::vector<LabelledPose> poses = right_poses();
  // Passes the first limits; the margin lies 0.09 of 0.1 below the worst, the share 0.01 of 0.02.
  poses.push_back(pose("flip", false, 0.94, 0.0, 0.71));
  const Calibration found = calibrate(poses);
  EXPECT_NEAR(found.limits[index_of("margin")].limit, 0.5 * (0.8 + 0.71), 1e-12);
  EXPECT_NEAR(found.limits[index_of("matched_share")].limit, 0.93, 1e-12);
  EXPECT_TRUE(found.inseparable.empty());
  EXPECT_EQ(found.limits[index_of("margin")].alone, 1U);
}

TEST(Calibration, NamesWhatNoCheckTellsFromARightPose) {
  std::vector<LabelledPose> poses = right_poses();
  poses.push_back(pose("twin", false, 0.97, 0.001, 0.9));
  const Calibration found = calibrate(poses);
  ASSERT_EQ(found.inseparable.size(), 1U);
  EXPECT_EQ(found.inseparable[0], "twin");
  EXPECT_NE(accept_table(found).find("1 wrong ones pass"), std::string::npos);
}

TEST(Calibration, AnUnmeasuredCheckRejectsNothing) {
  std::vector<LabelledPose> poses = right_poses();
  LabelledPose wrong;
  wrong.id = "unmeasured";
  poses.push_back(wrong);
  EXPECT_EQ(calibrate(poses).inseparable.size(), 1U);
}

}  // namespace
}  // namespace grapnel
