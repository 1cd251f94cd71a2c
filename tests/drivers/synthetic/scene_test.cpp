#include "drivers/synthetic/scene.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include "base/cloud_file.h"
#include "drivers/synthetic/scene_renderer.h"

namespace grapnel {
namespace {

Scene scene_of(const std::string& text) {
  return read_scene(parse_config(text, "scene.toml"), ".");
}

std::string refusal_of(const std::string& text) {
  try {
    static_cast<void>(scene_of(text));
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

constexpr const char* kStationed = R"(
[belt]
pitch_m = 0.9
dwell_frames = 3
move_frames = 2
stations = 4
[[part]]
name = "a"
model = "box"
station = 1
x_m = 0.05
yaw_rad = 0.3
)";

/// A frame of a scene without the sensor's errors.
struct Frame {
  SceneRenderer renderer;
  std::vector<std::uint16_t> depth;
  std::vector<Rgb8> color;

  Frame(const Scene& scene, std::int64_t number)
      : renderer(scene),
        depth(static_cast<std::size_t>(scene.camera.width * scene.camera.height)),
        color(depth.size()) {
    renderer.render(number, {depth.data(), scene.camera.width, scene.camera.height},
                    {color.data(), scene.camera.width, scene.camera.height});
  }
};

TEST(Scene, RestsPartsOnTheBelt) {
  const Mesh carton = make_carton({0.38, 0.28, 0.22});
  for (const Resting resting :
       {Resting::Upright, Resting::UpsideDown, Resting::OnSide, Resting::OnEnd}) {
    const Pose pose = rest_on_belt(carton, resting, 0.1, -0.2, 0.7);
    EXPECT_TRUE(is_rigid(pose.matrix(), 1e-12));
    double lowest_m = 1.0;
    for (const Vec3d& vertex : carton.vertices) lowest_m = std::min(lowest_m, (pose * vertex).z());
    EXPECT_NEAR(lowest_m, 0.0, 1e-12);
  }
  EXPECT_NEAR(rest_on_belt(carton, Resting::OnSide, 0, 0, 0).translation().z(), 0.14, 1e-12);
  EXPECT_NEAR(rest_on_belt(carton, Resting::OnEnd, 0, 0, 0).translation().z(), 0.19, 1e-12);
}

TEST(Scene, StandsStillDuringTheDwellAndMovesOnEvenly) {
  const Scene scene = scene_of(kStationed);
  const ScenePart& part = scene.parts[0];
  std::vector<double> x_m;
  for (std::int64_t frame = 5; frame < 11; ++frame) {
    x_m.push_back(world_from_part(scene, part, frame).translation().x());
  }
  EXPECT_EQ(first_dwell_frame(scene, 1), 5);
  EXPECT_EQ(x_m[0], 0.05);
  EXPECT_EQ(x_m[1], 0.05);
  EXPECT_EQ(x_m[2], 0.05);
  EXPECT_NEAR(x_m[3], 0.05 + 0.3, 1e-12);
  EXPECT_NEAR(x_m[4], 0.05 + 0.6, 1e-12);
  EXPECT_NEAR(x_m[5], 0.05 + 0.9, 1e-12);
}

TEST(Scene, PartsComeRoundAgainAfterTheLastStation) {
  const Scene scene = scene_of(kStationed);
  const ScenePart& part = scene.parts[0];
  for (std::int64_t frame = 0; frame < 20; ++frame) {
    EXPECT_TRUE(world_from_part(scene, part, frame)
                    .isApprox(world_from_part(scene, part, frame + 20), 1e-12));
    EXPECT_LE(std::fabs(world_from_part(scene, part, frame).translation().x()), 0.05 + 2.0 * 0.9);
  }
}

TEST(Scene, ABeltWithoutStationsRunsAtItsSpeed) {
  const Scene scene = scene_of("[scene]\nrate_hz = 25\n[belt]\nspeed_m_s = 0.5\n[[part]]\n");
  const double moved_m = world_from_part(scene, scene.parts[0], 50).translation().x() -
                         world_from_part(scene, scene.parts[0], 0).translation().x();
  EXPECT_NEAR(moved_m, 1.0, 1e-12);
}

TEST(Scene, CameraLooksDownAndTiltTurnsItsView) {
  SceneCamera camera;
  camera.height_m = 1.2;
  EXPECT_TRUE((camera.world_from_camera() * Vec3d(0, 0, 1.2)).isZero(1e-12));
  camera.tilt_rad = 0.1;
  const Vec3d seen = camera.world_from_camera() * Vec3d(0, 0, 1.2 / std::cos(0.1));
  EXPECT_NEAR(seen.z(), 0.0, 1e-12);
  EXPECT_NEAR(seen.y(), 1.2 * std::tan(0.1), 1e-12);
}

TEST(Scene, RandomPartsDependOnTheSeedAndDoNotOverlap) {
  const std::string text =
      "[belt]\npitch_m = 1\nstations = 5\n[[random]]\nkind = \"box\"\n"
      "size_m = [0.1, 0.1, 0.1]\nstations = 5\ncount = 3\n"
      "region_m = [-0.4, 0.4, -0.3, 0.3]\n";
  const Scene first = scene_of("[scene]\nseed = 3\n" + text);
  const Scene again = scene_of("[scene]\nseed = 3\n" + text);
  const Scene other = scene_of("[scene]\nseed = 4\n" + text);
  ASSERT_EQ(first.parts.size(), 15u);
  for (std::size_t i = 0; i < first.parts.size(); ++i) {
    EXPECT_EQ(first.parts[i].world_from_model.matrix(), again.parts[i].world_from_model.matrix());
    EXPECT_NE(first.parts[i].world_from_model.matrix(), other.parts[i].world_from_model.matrix());
    for (std::size_t k = 0; k < i; ++k) {
      if (first.parts[i].station != first.parts[k].station) continue;
      const Vec3d gap = first.parts[i].world_from_model.translation() -
                        first.parts[k].world_from_model.translation();
      EXPECT_GE(gap.norm(), 0.1 * std::sqrt(2.0));
    }
  }
}

TEST(Scene, RefusesWithFileLineKeyAndWhatIsAllowed) {
  const struct {
    const char* text;
    const char* expected;
  } kCases[] = {
      {"[scene]\nframes = 0\n", "scene.toml:2: scene.frames: 0 is out of range"},
      {"[camera]\nhight_m = 1\n", "did you mean \"height_m\""},
      {"[[part]]\nkind = \"crate\"\n",
       "one of \"box\", \"carton\", \"barrel\", \"sack\", \"mesh\""},
      {"[[part]]\nstation = 3\n", "part.station: 3 is not allowed; 0 to 0"},
      {"[[part]]\nresting = \"leaning\"\n", "\"leaning\" is not allowed"},
      {"[[random]]\nregion_m = []\n", "a list of 4 numbers is"},
      {"[[event]]\nexpected = \"maybe\"\n", "one of \"accept\", \"empty\", \"wrong\" is"},
      {"[[part]]\nsize_m = [1, 2]\n", "a list of 3 numbers is"},
      {"[[part]]\nkind = \"mesh\"\n", "needs a file"},
      {"[[event]]\nexpected = \"accept\"\n", "names its part"},
      {"[[event]]\npart = \"ghost\"\n", "no part is named \"ghost\""},
      {"[[fault]]\nat_frame = 3\n", "key \"kind\" is missing"},
      {"[[part]]\nworld_from_model = [2,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1]\n", "not a rotation"},
      {"[[random]]\ncount = 9\nregion_m = [0, 0.1, 0, 0.1]\n", "no free place"},
  };
  for (const auto& item : kCases) {
    EXPECT_NE(refusal_of(item.text).find(item.expected), std::string::npos)
        << item.text << " → " << refusal_of(item.text);
  }
}

TEST(Scene, TakesAnyMeshFromAFileBesideIt) {
  const std::filesystem::path folder =
      std::filesystem::path(testing::TempDir()) / "scene_with_mesh";
  std::filesystem::create_directories(folder);
  MeshData data;
  const Mesh carton = make_carton({0.38, 0.28, 0.22});
  for (const Vec3d& vertex : carton.vertices) data.vertices.push_back(vertex.cast<float>());
  data.triangles = carton.triangles;
  write_ply(folder / "part.ply", data);
  const Scene scene = read_scene(
      parse_config("[[part]]\nkind = \"mesh\"\nmesh = \"part.ply\"\n", "scene.toml"), folder);
  EXPECT_NEAR(enclosed_volume_m3(scene.parts[0].mesh), enclosed_volume_m3(carton), 1e-8);
  EXPECT_NEAR(scene.parts[0].world_from_model.translation().z(), 0.11, 1e-6);
  std::filesystem::remove_all(folder);
}

constexpr const char* kExact =
    "[sensor]\nnoise = false\nshadow = false\nmixed_ratio = 0\n"
    "disparity_step_px = 0\ninvalid_columns = 0\n";

TEST(SceneRenderer, MeasuresBeltAndPartAtTheirHeights) {
  const Scene scene = scene_of(std::string(kExact) + "[camera]\nheight_m = 1.1\n[[part]]\n");
  const Frame frame(scene, 0);
  EXPECT_EQ(frame.depth[240u * 640u + 320u], 900);  // a box of 0.2 m below the camera
  EXPECT_EQ(frame.depth[10u * 640u + 10u], 1100);
}

TEST(SceneRenderer, TruthPoseMapsTheModelOntoTheMeasurement) {
  const Scene scene =
      scene_of(std::string(kExact) +
               "[camera]\nheight_m = 1.1\ntilt_rad = 0.15\n[[part]]\nkind = \"sack\"\n"
               "x_m = 0.05\ny_m = 0.12\nyaw_rad = 0.8\n");
  const Frame frame(scene, 0);
  ASSERT_EQ(frame.renderer.parts().size(), 1u);
  const PartView& view = frame.renderer.parts()[0];
  const Mesh& mesh = scene.parts[0].mesh;
  const Intrinsics camera = scene.camera.intrinsics();
  // Each vertex of the upper sheet projects onto a pixel of about its depth, unless it is hidden.
  std::size_t compared = 0;
  for (std::size_t i = 0; i < mesh.vertices.size() / 2; ++i) {
    const Vec3d point = view.camera_from_model * mesh.vertices[i];
    const int u = static_cast<int>(std::lround(camera.fx * point.x() / point.z() + camera.cx));
    const int v = static_cast<int>(std::lround(camera.fy * point.y() / point.z() + camera.cy));
    if (frame.renderer.part_index().at(u, v) != 0) continue;
    if (-frame.renderer.normal_at(u, v).z() < 0.7f) continue;
    ++compared;
    // Half a pixel at 45° is 1 mm at 1 m; facets and counts add as much.
    EXPECT_NEAR(frame.depth[static_cast<std::size_t>(v * 640 + u)] * 0.001, point.z(), 0.004);
  }
  EXPECT_GT(compared, 1000u);
  EXPECT_TRUE(view.inside);
}

TEST(SceneRenderer, ShadowOfABoxIsAsWideAsTheDisparitiesSay) {
  const Scene scene = scene_of(
      "[sensor]\nnoise = false\nmixed_ratio = 0\ninvalid_columns = 0\n"
      "disparity_step_px = 0\n[camera]\nheight_m = 1.1\n[[part]]\n"
      "x_m = 0.15\n");
  const Frame frame(scene, 0);
  // The box's top is at 0.9 m, its left edge at x = -0.05 m.
  const double left_edge_px = 319.5 - 0.05 / 0.9 * 575.0;
  const double width_px = 575.0 * 0.075 * (1.0 / 0.9 - 1.0 / 1.1);
  const std::uint16_t* row = frame.depth.data() + 240 * 640;
  int dark = 0;
  for (int u = 200; u < 500; ++u) dark += row[u] == 0 ? 1 : 0;
  EXPECT_NEAR(dark, width_px, 1.5);
  EXPECT_EQ(row[static_cast<int>(left_edge_px) - 2], 0);
  EXPECT_EQ(row[static_cast<int>(left_edge_px - width_px) - 2], 1100);
}

TEST(SceneRenderer, CountsWhatIsCoveredVisibleAndMeasured) {
  // The small box lies half under a large plate that hovers above it.
  const Scene scene = scene_of(std::string(kExact) +
                               "[[part]]\nname = \"small\"\nsize_m = [0.2, 0.2, 0.1]\n"
                               "[[part]]\nname = \"plate\"\nsize_m = [0.4, 0.4, 0.02]\n"
                               "world_from_model = [1,0,0,0.2, 0,1,0,0, 0,0,1,0.11, 0,0,0,1]\n");
  const Frame frame(scene, 0);
  ASSERT_EQ(frame.renderer.parts().size(), 2u);
  const PartView& small = frame.renderer.parts()[0];
  EXPECT_NEAR(static_cast<double>(small.visible_pixels) / static_cast<double>(small.covered_pixels),
              0.5, 0.03);
  EXPECT_EQ(small.measured_pixels, small.visible_pixels);
  EXPECT_EQ(frame.renderer.parts()[1].covered_pixels, frame.renderer.parts()[1].visible_pixels);
}

TEST(SceneRenderer, AFrameDependsOnSceneAndNumberAlone) {
  const Scene scene = scene_of(kStationed);
  const Frame direct(scene, 7);
  Frame after_others(scene, 2);
  after_others.renderer.render(7, {after_others.depth.data(), 640, 480},
                               {after_others.color.data(), 640, 480});
  EXPECT_EQ(direct.depth, after_others.depth);
  EXPECT_EQ(direct.color, after_others.color);
}

}  // namespace
}  // namespace grapnel
