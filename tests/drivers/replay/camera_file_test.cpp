#include "drivers/replay/camera_file.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "drivers/replay/undistort.h"

namespace grapnel {
namespace {

constexpr const char* kPlain =
    "width = 640\nheight = 480\nfx = 585\nfy = 586.5\ncx = 320\ncy = 240\nmetres_per_unit = "
    "0.001\n";

std::string message_of(const std::string& text) {
  try {
    (void)parse_camera_file(parse_config(text, "camera.toml"));
  } catch (const InputError& error) {
    return error.what();
  }
  return "accepted";
}

TEST(CameraFile, ReadsTheRequiredKeysAndKeepsDefaultsForTheRest) {
  const CameraFile camera = parse_camera_file(parse_config(kPlain, "camera.toml"));
  EXPECT_EQ(camera.intrinsics(), (Intrinsics{640, 480, 585.0, 586.5, 320.0, 240.0}));
  EXPECT_EQ(camera.invalid, (std::vector<double>{0.0, 65535.0}));
  EXPECT_TRUE(camera.distortion.empty());
}

TEST(CameraFile, ItsTextReadsBackAsTheSame) {
  CameraFile camera = parse_camera_file(parse_config(kPlain, "camera.toml"));
  camera.metres_per_unit = 0.0002;
  camera.distortion = {0.1, -0.25};
  camera.serial = "A00366";
  camera.invalid = {2047.0};
  const CameraFile read = parse_camera_file(parse_config(camera_file_text(camera), "x"));
  EXPECT_EQ(read.intrinsics(), camera.intrinsics());
  EXPECT_EQ(read.metres_per_unit, camera.metres_per_unit);
  EXPECT_EQ(read.distortion, camera.distortion);
  EXPECT_EQ(read.serial, camera.serial);
  EXPECT_EQ(read.invalid, camera.invalid);
}

TEST(CameraFile, SaysWhatIsWrongAndWhere) {
  EXPECT_EQ(message_of("width = 640\n"), "camera.toml:1: key \"height\" is missing");
  EXPECT_EQ(message_of(std::string(kPlain) + "baselin_m = 0.1\n"),
            "camera.toml:8: baselin_m: unknown key; did you mean \"baseline_m\"?");
  EXPECT_EQ(
      message_of(std::string(kPlain) + "invalid = [0, 70000]\n"),
      "camera.toml:8: invalid: 70000 is not allowed in the list; numbers from 0 to 65535 are");
  EXPECT_EQ(message_of(std::string(kPlain) + "invalid = [0.5]\n"),
            "camera.toml:8: invalid: a whole number from 0 to 65535 is allowed in the list");
  EXPECT_EQ(message_of(std::string(kPlain) + "distortion = [0,0,0,0,0,1]\n"),
            "camera.toml:8: distortion: 6 numbers are not allowed; at most 5 are");
}

TEST(CameraFile, ErasesEveryMarkerOfNoReading) {
  CameraFile camera;
  camera.invalid = {0.0, 65535.0, 2047.0};
  std::vector<std::uint16_t> depth = {0, 1, 2046, 2047, 65534, 65535};
  erase_invalid(camera, depth);
  EXPECT_EQ(depth, (std::vector<std::uint16_t>{0, 1, 2046, 0, 65534, 0}));
}

TEST(Undistort, DoesNothingWithoutDistortion) {
  CameraFile camera = parse_camera_file(parse_config(kPlain, "camera.toml"));
  camera.distortion = {0.0, 0.0};
  EXPECT_TRUE(undistortion_map(camera).empty());
}

TEST(Undistort, FetchesAPixelFromWhereTheLensPutIt) {
  CameraFile camera;
  camera.width = 200;
  camera.height = 100;
  camera.fx = camera.fy = 100.0;
  camera.cx = 100.0;
  camera.cy = 50.0;
  camera.distortion = {0.1};
  const std::vector<std::uint32_t> map = undistortion_map(camera);
  const auto source_of = [&](int u, int v) {
    return map[static_cast<std::size_t>(v * camera.width + u)];
  };
  EXPECT_EQ(source_of(100, 50), 50u * 200u + 100u);
  // x = 0.5, r² = 0.25: x (1 + 0.1 · 0.25) = 0.5125, column 151.25.
  EXPECT_EQ(source_of(150, 50), 50u * 200u + 151u);
  // x = -1: -1.1, column -10: outside.
  EXPECT_EQ(source_of(0, 50), kNoSource);
}

TEST(Undistort, TakesTheTangentialTermsAsBrownDid) {
  CameraFile camera;
  camera.width = 200;
  camera.height = 200;
  camera.fx = camera.fy = 100.0;
  camera.cx = camera.cy = 100.0;
  camera.distortion = {0.0, 0.0, 0.02, 0.04};
  const std::vector<std::uint32_t> map = undistortion_map(camera);
  // x = 0.5, y = 0.2, r² = 0.29: xd = x + 2 p1 x y + p2 (r² + 2x²) = 0.5356, yd = y + p1 (r² + 2y²)
  // + 2 p2 x y = 0.2154.
  EXPECT_EQ(map[120 * 200 + 150], 122u * 200u + 154u);
}

TEST(Undistort, LeavesAHoleWhereThereIsNoSource) {
  std::vector<std::uint16_t> pixels = {10, 20, 30};
  undistort<std::uint16_t>(std::vector<std::uint32_t>{2, kNoSource, 0}, pixels);
  EXPECT_EQ(pixels, (std::vector<std::uint16_t>{30, 0, 10}));
}

}  // namespace
}  // namespace grapnel
