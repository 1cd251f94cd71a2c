#include "firmware_app/plc_object.h"

#include <gtest/gtest.h>

#include "base/math.h"

namespace grapnel {
namespace {

/// A box 0.2 m high whose grasp lies on the model's upper face and points down into it.
ModelProfile box_profile(Symmetry symmetry) {
  ModelProfile model;
  model.symmetry = symmetry;
  model.model_from_grasp.linear() = Vec3d(1.0, -1.0, -1.0).asDiagonal();
  model.model_from_grasp.translation() = Vec3d(0.0, 0.0, 0.1);
  return model;
}

Pose seen_from_above(double yaw_rad) {
  Pose camera_from_model = Pose::Identity();
  camera_from_model.linear() = Vec3d(1.0, -1.0, -1.0).asDiagonal();
  camera_from_model.translation() = Vec3d(0.1, 0.2, 1.0);
  camera_from_model.linear() =
      camera_from_model.linear() * rotation_from_vector(Vec3d(0.0, 0.0, yaw_rad));
  return camera_from_model;
}

Pose turned(const Pose& pose, const Vec3d& rotation_vector_rad) {
  Pose result = pose;
  result.linear() = pose.linear() * rotation_from_vector(rotation_vector_rad);
  return result;
}

TEST(ReachableEquivalent, GraspsABoxOnTheSideTowardTheCamera) {
  const ModelProfile model = box_profile(Symmetry::Box);
  for (const double yaw_rad : {0.0, 0.7, -1.2, 2.9}) {
    const Pose truth = seen_from_above(yaw_rad);
    for (const Vec3d& turn :
         {Vec3d(0, 0, 0), Vec3d(math::kPi, 0, 0), Vec3d(0, math::kPi, 0), Vec3d(0, 0, math::kPi)}) {
      const Pose pose = reachable_equivalent(turned(truth, turn), model);
      const Pose grasp = pose * model.model_from_grasp;
      EXPECT_NEAR(grasp.translation().z(), 0.9, 1e-12);
      EXPECT_NEAR(grasp.linear()(2, 2), 1.0, 1e-12);  // its z goes on, away from the camera
      // Whatever of the four was found, the same one is told.
      EXPECT_NEAR(rotation_angle_rad(pose, reachable_equivalent(truth, model)), 0.0, 1e-6);
    }
  }
}

TEST(ReachableEquivalent, TurnsAnAxiallySymmetricGraspTowardTheCamera) {
  const ModelProfile model = box_profile(Symmetry::AxisZ);
  for (const double yaw_rad : {0.0, 0.7, -1.2, 2.9}) {
    const Pose grasp =
        reachable_equivalent(seen_from_above(yaw_rad), model) * model.model_from_grasp;
    EXPECT_NEAR(rotation_angle_rad(grasp, Pose::Identity()), 0.0, 1e-6);
  }
}

TEST(ReachableEquivalent, LeavesAModelWithoutSymmetryAlone) {
  const Pose pose = turned(seen_from_above(0.3), Vec3d(math::kPi, 0, 0));
  EXPECT_TRUE(reachable_equivalent(pose, box_profile(Symmetry::None)).isApprox(pose));
}

TEST(PlcObject, AddsThePresetsPickOffsetInTheGraspsFrame) {
  JobProfile profile;
  ModelProfile model = box_profile(Symmetry::None);
  model.grasp_from_pick.translation() = Vec3d(0.0, 0.0, -0.05);  // 5 cm short of the part
  model.grasp_from_pick.linear() = Vec3d(1.0, -1.0, -1.0).asDiagonal();
  profile.models.push_back(model);
  RegistrationReport report;
  report.accepted = true;
  report.target_from_source = seen_from_above(0.0);
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
