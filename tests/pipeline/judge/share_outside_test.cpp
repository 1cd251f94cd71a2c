#include "pipeline/judge/share_outside.h"

#include <gtest/gtest.h>

#include "tests/pipeline/support/surfaces.h"

namespace grapnel {
namespace {

TEST(ShareOutside, CountsThePointsThatFaceTheCameraAlone) {
  test::OwnedSurface points(8, 0);
  const auto add = [&](float x, float normal_z) {
    const std::size_t i = points->size++;
    points->x[i] = x;
    points->nz[i] = normal_z;
  };
  add(-1.0F, -1.0F);  // column -50
  add(-0.5F, -1.0F);  // column 0, the first
  add(0.1F, -1.0F);   // column 60
  add(2.0F, -1.0F);   // column 250
  add(3.0F, 1.0F);    // outside, but turned away
  Pose camera_from_model = Pose::Identity();
  camera_from_model.translation().z() = 1.0;
  const Intrinsics camera = {101, 101, 100.0, 100.0, 50.0, 50.0};
  EXPECT_DOUBLE_EQ(share_outside(*points, camera_from_model, camera), 0.5);
  camera_from_model.translation().z() = -1.0;
  EXPECT_DOUBLE_EQ(share_outside(*points, camera_from_model, camera), 1.0) << "behind the camera";
}

}  // namespace
}  // namespace grapnel
