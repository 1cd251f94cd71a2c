#include "tests/example/sack_views.h"

#include <cmath>

#include "base/rng.h"
#include "drivers/synthetic/scene_renderer.h"
#include "workbench/input.h"

namespace grapnel::example {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kRange_m = 1.0;        // from the camera to the belt below the sack
constexpr double kAboveBelt_m = 0.015;  // three sigma of the sensor at that range, and a margin

Scene scene_of(std::uint64_t seed, double tilt_rad) {
  Rng rng(seed);
  Scene scene;
  scene.seed = 2 * seed + (tilt_rad > 0.0 ? 1 : 0);
  scene.camera.tilt_rad = tilt_rad;
  scene.camera.height_m = kRange_m * std::cos(tilt_rad);
  scene.camera.y_m = -kRange_m * std::sin(tilt_rad);
  ScenePart sack;
  sack.name = "sack";
  sack.kind = PartKind::Sack;
  sack.mesh = make_sack(default_size_m(PartKind::Sack), 100 + seed);
  sack.world_from_model =
      rest_on_belt(sack.mesh, Resting::Upright, 0.0, 0.0, 2.0 * kPi * rng.uniform());
  scene.parts.push_back(std::move(sack));
  return scene;
}

SackView render(const Scene& scene) {
  const SceneCamera& camera = scene.camera;
  SackView view;
  const auto pixels =
      static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
  view.depth.resize(pixels);
  view.color.resize(pixels);
  SceneRenderer renderer(scene);
  renderer.render(0, {view.depth.data(), camera.width, camera.height},
                  {view.color.data(), camera.width, camera.height});
  view.frame.depth = {view.depth.data(), camera.width, camera.height};
  view.frame.color = {view.color.data(), camera.width, camera.height};
  view.frame.metres_per_unit = camera.metres_per_unit;
  view.frame.intrinsics = camera.intrinsics();
  view.frame.baseline_m = camera.baseline_m;
  const Pose world_from_camera = camera.world_from_camera();
  for (int v = 0; v < camera.height; ++v) {
    for (int u = 0; u < camera.width; ++u) {
      const Vec3d p = world_from_camera * point_of_pixel(view.frame, u, v).cast<double>();
      if (p.z() < kAboveBelt_m) {
        view.depth[static_cast<std::size_t>(v) * static_cast<std::size_t>(camera.width) +
                   static_cast<std::size_t>(u)] = 0;
      }
    }
  }
  view.surface = make_surface(view.frame);
  return view;
}

}  // namespace

SackPair render_pair(std::uint64_t seed) {
  const double half_rad = 0.5 * kApart_deg * kPi / 180.0;
  const Scene left = scene_of(seed, -half_rad);
  const Scene right = scene_of(seed, half_rad);
  SackPair pair;
  pair.source = render(left);
  pair.target = render(right);
  pair.target_from_source =
      right.camera.world_from_camera().inverse() * left.camera.world_from_camera();
  pair.middle = left.camera.world_from_camera().inverse() * Vec3d(0.0, 0.0, 0.08);
  return pair;
}

PoseError error_of(const Pose& target_from_source, const SackPair& pair) {
  PoseError error;
  error.shift_m = (target_from_source * pair.middle - pair.target_from_source * pair.middle).norm();
  error.turn_deg = rotation_angle_rad(target_from_source, pair.target_from_source) * 180.0 / kPi;
  return error;
}

}  // namespace grapnel::example
