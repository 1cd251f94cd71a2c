// From a pose in the camera's frame to the registers that a robot reads, with numbers worked by
// hand.
//
// The camera hangs 1.1 m above the belt and looks straight down; the robot's base stands 0.8 m
// upstream and 0.3 m aside: robot_from_camera = diag(1, -1, -1), (0.8, 0.3, 1.1). A box 0.2 m high
// lies at (0.05, -0.02) under the camera, turned by 30° about the vertical, its middle 1.0 m away.
// Its top grasp's z points down into it. So in the robot's frame the box is turned by Rz(30°) and
// stands at (0.85, 0.32, 0.10); the grasp is Rz(30°) Rx(180°) at (0.85, 0.32, 0.20). A pick offset
// of (10, 0, -50) mm in the grasp's frame is Rz(30°) (10, 0, 50) mm = (8.660254, 5, 50) mm in the
// robot's: the pick frame lies at (0.858660, 0.325, 0.25).
#include <gtest/gtest.h>

#include <array>
#include <string>
#include <vector>

#include "drivers/modbus/pose_format.h"
#include "drivers/modbus/register_image.h"
#include "drivers/modbus/registers.h"
#include "drivers/modbus/report_encoder.h"
#include "firmware_app/plc_object.h"
#include "firmware_app/preset_source.h"
#include "firmware_app/settings.h"

namespace grapnel {
namespace {

constexpr double kCos30 = 0.8660254037844386;

Settings settings_with_calibration() {
  return read_settings(parse_config("active_preset = 11\n"
                                    "[camera]\ndriver = \"replay\"\n"
                                    "[calibration]\n"
                                    "robot_from_camera = [1, 0, 0, 0.8,  0, -1, 0, 0.3,  "
                                    "0, 0, -1, 1.1,  0, 0, 0, 1]\n",
                                    "g.toml"),
                       "g.toml", "/etc/grapnel");
}

/// The shipped box: 0.4 × 0.3 × 0.2 m, grasp on top.
JobProfile box_profile(const std::vector<std::string>& overrides) {
  const std::filesystem::path config = std::filesystem::path(GRAPNEL_SOURCE_DIR) / "config";
  return profile_of(load_preset(config / "presets/11-box.toml", config / "models", overrides),
                    settings_with_calibration());
}

RegistrationReport box_report() {
  RegistrationReport report;
  report.accepted = true;
  report.has_pose = true;
  report.code = Code::ObjectFound;
  report.target_from_source.linear() << kCos30, -0.5, 0.0, -0.5, -kCos30, 0.0, 0.0, 0.0, -1.0;
  report.target_from_source.translation() = Vec3d(0.05, -0.02, 1.0);
  return report;
}

struct Expected {
  std::uint16_t format;
  std::array<std::int32_t, 7> registers;  // µm; 0.001° or 10⁻⁶
};

std::array<std::int32_t, 7> registers_of(const PlcObject& object, std::uint16_t format) {
  PlcResult result;
  result.code = object.code;
  result.pose_format = format;
  result.objects.push_back(object);
  RegisterImage image(WordOrder::Abcd);
  encode_result(result, 1, true, image);
  std::array<std::int32_t, 7> registers{};
  for (std::size_t i = 0; i < registers.size(); ++i) {
    registers[i] = image.i32(registers::result::kRecordFirst + registers::object::kX + 2 * i);
  }
  return registers;
}

void expect_registers(const PlcObject& object, const std::vector<Expected>& all) {
  for (const Expected& expected : all) {
    const std::array<std::int32_t, 7> registers = registers_of(object, expected.format);
    for (std::size_t i = 0; i < registers.size(); ++i) {
      // The last digit may round either way.
      EXPECT_NEAR(registers[i], expected.registers[i], 1)
          << "format " << expected.format << ", number " << i;
    }
  }
}

TEST(GraspRegisters, HoldTheTopGraspInTheRobotsFrameInEveryFormat) {
  const PlcObject object = to_plc_object(box_report(), box_profile({}), false, 0);
  EXPECT_EQ(object.frame, PoseFrame::RobotBase);
  EXPECT_EQ(object.pick_point_id, 1);
  constexpr std::int32_t kX = 850000, kY = 320000, kZ = 200000;
  expect_registers(
      object,
      {// Rz(30) Ry(0) Rx(180), in both orders of its letters.
       {1, {kX, kY, kZ, 30000, 0, 180000, 0}},
       {2, {kX, kY, kZ, 180000, 0, 30000, 0}},
       // (cos 15°, 0, 0, sin 15°) (0, 1, 0, 0) = (0, cos 15°, sin 15°, 0).
       {3, {kX, kY, kZ, 0, 965926, 258819, 0}},
       // Half a turn about (cos 15°, sin 15°, 0): π times that.
       {4, {kX, kY, kZ, 3034545, 813104, 0, 0}},
       // Rz(30) Rx(180) = Rx(180) Rz(-30).
       {5, {kX, kY, kZ, 180000, 0, -30000, 0}},
       // Rx(180) = Ry(180) Rz(180), and Ry(180) Rz(a) = Rz(-a) Ry(180): Rz(30 - 180) Ry(180).
       {6, {kX, kY, kZ, -150000, 180000, 0, 0}},
       // The heading of the x axis alone.
       {7, {kX, kY, kZ, 30000, 0, 0, 0}}});
}

TEST(GraspRegisters, HoldThePresetsPickOffsetAndItsFlip) {
  constexpr std::int32_t kX = 858660, kY = 325000, kZ = 250000;
  const std::string offset = "pick_offset_m=[0.01, 0.0, -0.05]";
  expect_registers(to_plc_object(box_report(), box_profile({offset}), false, 0),
                   {{1, {kX, kY, kZ, 30000, 0, 180000, 0}}});
  // Half a turn about the pick frame's own x: Rz(30) Rx(180) Rx(180) = Rz(30), at the same place.
  expect_registers(to_plc_object(box_report(), box_profile({offset, "flip_z=true"}), false, 0),
                   {{1, {kX, kY, kZ, 30000, 0, 0, 0}}, {3, {kX, kY, kZ, 965926, 0, 0, 258819}}});
}

TEST(GraspRegisters, StayInTheCamerasFrameWhenThePlcAsks) {
  const PlcObject object = to_plc_object(box_report(), box_profile({}), true, 0);
  EXPECT_EQ(object.frame, PoseFrame::Camera);
  // On the top, 0.1 m nearer than the middle; its x axis (cos 30°, -sin 30°, 0), its z away from
  // the camera: a turn by -30° about z.
  expect_registers(object, {{1, {50000, -20000, 900000, -30000, 0, 0, 0}}});
}

TEST(GraspRegisters, OfASurfaceGraspHoldThatGraspWithThePresetsOffset) {
  RegistrationReport report = box_report();
  report.accepted = false;
  report.surface_grasp = true;
  report.code = Code::SurfaceGrasp;
  report.reasons.push_back({Check::MatchedShare, 0.4, 0.85});
  // z away from the camera, x along the image's own, at (0.1, 0.2) and 0.95 m away: in the robot's
  // frame Rx(180) at (0.9, 0.1, 0.15), and 5 cm before the surface 0.20 high.
  report.target_from_grasp.translation() = Vec3d(0.1, 0.2, 0.95);
  const PlcObject object =
      to_plc_object(report, box_profile({"pick_offset_m=[0.0, 0.0, -0.05]"}), false, 0);
  EXPECT_FALSE(object.accepted);
  EXPECT_EQ(object.pick_point_id, 0);
  expect_registers(object, {{1, {900000, 100000, 200000, 0, 0, 180000, 0}}});
}

TEST(GraspRegisters, TellASurfaceGraspFromAModelsPoseByTheirDecision) {
  const auto decision_of = [](const PlcObject& object) {
    PlcResult result;
    result.objects.push_back(object);
    RegisterImage image(WordOrder::Abcd);
    encode_result(result, 1, true, image);
    return image.u16(registers::result::kRecordFirst + registers::object::kDecision);
  };
  RegistrationReport report = box_report();
  EXPECT_EQ(decision_of(to_plc_object(report, box_profile({}), false, 0)), 1);
  report.accepted = false;
  report.surface_grasp = true;
  EXPECT_EQ(decision_of(to_plc_object(report, box_profile({}), false, 0)), 2);
  report.surface_grasp = false;
  EXPECT_EQ(decision_of(to_plc_object(report, box_profile({}), false, 0)), 0);
  // A rejected one gives no numbers away.
  EXPECT_EQ(registers_of(to_plc_object(report, box_profile({}), false, 0), 1)[0], kNoPose);
}

}  // namespace
}  // namespace grapnel
