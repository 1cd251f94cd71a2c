// Several parts, touching parts and a deformed sack, from the simulated camera to the registers.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/system/daemon_process.h"

namespace grapnel::test {
namespace {

std::string part(const std::string& kind, double x_m, double y_m, double yaw_rad,
                 const std::string& more = "") {
  return "[[part]]\nkind = \"" + kind + "\"\nmodel = \"" + kind +
         "\"\nx_m = " + std::to_string(x_m) + "\ny_m = " + std::to_string(y_m) +
         "\nyaw_rad = " + std::to_string(yaw_rad) + "\n" + more;
}

std::string with(std::string text, const std::string& old, const std::string& now) {
  return text.replace(text.find(old), old.size(), now);
}

/// A camera 1.1 m above the belt.
std::string scene_of(const std::vector<std::string>& parts) {
  std::string text = Site::scene_text();
  text.erase(text.find("[[part]]"));
  for (const std::string& one : parts) text += one;
  return text;
}

/// Where a part's top grasp is in the camera's frame: x stays, y turns over.
bool grasp_at(const PlcObject& object, double x_m, double y_m) {
  const Vec3d p = object.frame_from_grasp.translation();
  // A few steps of the sensor's depth; an outline is known to half of a pixel's 3.8 mm.
  return object.accepted && std::abs(p.x() - x_m) < 0.006 && std::abs(p.y() + y_m) < 0.006;
}

TEST(SeveralObjects, ThePlcReadsThreePartsOfOneFrameEachWhereItLies) {
  const Site site;
  // From 1.5 m the tops' image is 1.4 × 1.1 m.
  const std::string scene =
      scene_of({part("carton", -0.42, 0.2, 0.3), part("carton", 0.05, -0.2, 1.2),
                part("carton", 0.40, 0.18, 1.4)});
  site.write("scene.toml", with(scene, "height_m = 1.1", "height_m = 1.5"));
  site.write("grapnel.toml", with(Site::config_text(13), "-1.0, 1.1]", "-1.0, 1.5]"));
  DaemonProcess daemon(site);
  ASSERT_TRUE(daemon.wait_ready());
  Plc plc(daemon.port());
  const PlcAnswer answer =
      plc.send(PlcCommandCode::Register, {.max_objects = 8, .timeout_ms = 20'000});
  const PlcResult& result = answer.reading.result;
  ASSERT_EQ(result.code, Code::ObjectFound);
  EXPECT_EQ(result.found, 3);
  ASSERT_EQ(result.objects.size(), 3U);
  int seen = 0;
  for (const PlcObject& object : result.objects) {
    if (grasp_at(object, -0.42, 0.2)) seen |= 1;
    if (grasp_at(object, 0.05, -0.2)) seen |= 2;
    if (grasp_at(object, 0.40, 0.18)) seen |= 4;
  }
  EXPECT_EQ(seen, 7);
  for (std::size_t i = 1; i < result.objects.size(); ++i) {
    EXPECT_GE(result.objects[i - 1].quality_score, result.objects[i].quality_score);
  }
  // The preset's own wish is one.
  const PlcAnswer one = plc.send(PlcCommandCode::Register, {.timeout_ms = 20'000});
  EXPECT_EQ(one.reading.result.objects.size(), 1U);
  EXPECT_EQ(one.reading.result.found, 3);
}

TEST(SeveralObjects, PartsThatTouchAreRefusedByName) {
  const Site site;
  // Two boxes end to end, a millimetre apart.
  site.write("scene.toml",
             scene_of({part("box", -0.2005, 0.0, 0.0), part("box", 0.2005, 0.0, 0.0)}));
  site.write("grapnel.toml", Site::config_text(11));
  DaemonProcess daemon(site);
  ASSERT_TRUE(daemon.wait_ready());
  Plc plc(daemon.port());
  const PlcResult result =
      plc.send(PlcCommandCode::Register, {.timeout_ms = 20'000}).reading.result;
  EXPECT_EQ(result.code, Code::PartsTouch);
  EXPECT_EQ(result.found, 1);
  ASSERT_EQ(result.objects.size(), 1U);
  EXPECT_FALSE(result.objects[0].has_pose());
  EXPECT_NE(result.objects[0].reasons & 1U << 20U, 0U);  // bit n stands for code 1000 + n
}

TEST(SurfaceGrasp, ThePlcTellsItFromAModelsPose) {
  const Site site;
  // Another filling than the taught sack's.
  site.write(
      "scene.toml",
      scene_of({part("sack", 0.05, 0.02, 0.3, "seed = 1003\nsize_m = [0.47, 0.36, 0.14]\n")}));
  site.write("presets/10-sack.toml",
             site.read("presets/10-sack.toml") + "\n[surface_grasp]\nenabled = true\n");
  DaemonProcess daemon(site);
  ASSERT_TRUE(daemon.wait_ready());
  Plc plc(daemon.port());
  const PlcAnswer answer = plc.send(PlcCommandCode::Register, {.timeout_ms = 20'000});
  const PlcResult& result = answer.reading.result;
  ASSERT_EQ(result.code, Code::SurfaceGrasp);
  EXPECT_NE(answer.reading.status.flags & kFlagResultValid, 0);
  ASSERT_EQ(result.objects.size(), 1U);
  const PlcObject& object = result.objects[0];
  EXPECT_FALSE(object.accepted);
  EXPECT_TRUE(object.surface_grasp);
  EXPECT_EQ(object.code, Code::SurfaceGrasp);
  EXPECT_EQ(object.pick_point_id, 0);
  EXPECT_NE(object.reasons, 0U);  // why the model does not fit
  const Vec3d grasp = object.frame_from_grasp.translation();
  // On the sack's top, well inside its half metre, and not on the belt.
  EXPECT_NEAR(grasp.x(), 0.05, 0.2);
  EXPECT_NEAR(grasp.y(), -0.02, 0.15);
  EXPECT_LT(grasp.z(), 1.1 - 0.05);
  EXPECT_GT(grasp.z(), 1.1 - 0.2);
  EXPECT_GT(object.frame_from_grasp.linear()(2, 2), 0.9);  // z away from the camera, into the sack
}

}  // namespace
}  // namespace grapnel::test
