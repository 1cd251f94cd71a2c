#include "firmware_app/plc_object.h"

#include <gtest/gtest.h>

namespace grapnel {
namespace {

/// A box 0.2 m high whose grasp lies on the model's upper face and points down into it.
ModelProfile box_profile() {
  ModelProfile model;
  model.model_from_grasp.linear() = Vec3d(1.0, -1.0, -1.0).asDiagonal();
  model.model_from_grasp.translation() = Vec3d(0.0, 0.0, 0.1);
  return model;
}

Pose seen_from_above() {
  Pose camera_from_model = Pose::Identity();
  camera_from_model.linear() = Vec3d(1.0, -1.0, -1.0).asDiagonal();
  camera_from_model.translation() = Vec3d(0.1, 0.2, 1.0);
  return camera_from_model;
}

TEST(PlcObject, AddsThePresetsPickOffsetInTheGraspsFrame) {
  JobProfile profile;
  ModelProfile model = box_profile();
  model.grasp_from_pick.translation() = Vec3d(0.0, 0.0, -0.05);  // 5 cm short of the part
  model.grasp_from_pick.linear() = Vec3d(1.0, -1.0, -1.0).asDiagonal();
  profile.models.push_back(model);
  RegistrationReport report;
  report.accepted = true;
  report.target_from_source = seen_from_above();
  const PlcObject object = to_plc_object(report, profile, false, 0);
  EXPECT_TRUE(object.frame_from_grasp.translation().isApprox(Vec3d(0.1, 0.2, 0.85)));
  EXPECT_NEAR(object.frame_from_grasp.linear()(2, 2), -1.0, 1e-12);  // z up, toward the camera
}

TEST(PlcObject, AReportOfAnUnknownModelHasNoIdAndDoesNoHarm) {
  RegistrationReport report;
  report.model = 7;
  EXPECT_EQ(to_plc_object(report, JobProfile{}, false, 0).model_id, 0);
}

}  // namespace
}  // namespace grapnel
