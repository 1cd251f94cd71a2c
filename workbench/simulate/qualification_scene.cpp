#include "workbench/simulate/qualification_scene.h"

#include <algorithm>
#include <array>
#include <string>
#include <utility>

#include "base/geometry.h"
#include "base/math.h"

namespace grapnel {
namespace {

constexpr double kTwoPi = 6.283185307179586;
constexpr double kQuarterTurn = kTwoPi / 4.0;
constexpr std::uint32_t kPartClasses = 5;

Resting draw_resting(PartClass part, Rng& rng) {
  switch (part) {
    case PartClass::Box:
    case PartClass::NearlySymmetric:
      return static_cast<Resting>(rng.below(4));
    case PartClass::Sack:
      return static_cast<Resting>(rng.below(2));
    default:
      return Resting::Upright;
  }
}

void draw_camera(Scene& scene, Rng& rng) {
  scene.camera.height_m = rng.uniform(1.05, 1.35);
  scene.camera.tilt_rad = rng.uniform(-0.15, 0.15);
  scene.camera.color = false;
  scene.belt.albedo = rng.uniform(0.25, 0.6);
  scene.frames = 1;
  scene.seed = rng.next_u64() >> 16;
}

ScenePart make_part(std::string name, Mesh mesh, Rng& rng) {
  ScenePart part;
  part.name = std::move(name);
  part.kind = PartKind::Mesh;
  part.albedo = rng.uniform(0.3, 0.9);
  part.mesh = std::move(mesh);
  return part;
}

/// Somewhere under the camera.
ScenePart lay_down(std::string name, Mesh mesh, Resting resting, Rng& rng) {
  ScenePart part = make_part(std::move(name), std::move(mesh), rng);
  const double x_m = rng.uniform(-0.15, 0.15);
  const double y_m = rng.uniform(-0.12, 0.12);
  part.world_from_model = rest_on_belt(part.mesh, resting, x_m, y_m, rng.uniform(0.0, kTwoPi));
  return part;
}

double reach_m(const ScenePart& part, const Vec3d& direction) {
  double farthest_m = -1e9;
  for (const Vec3d& vertex : part.mesh.vertices) {
    farthest_m = std::max(farthest_m, direction.dot(part.world_from_model * vertex));
  }
  return farthest_m;
}

/// Beside the first part, `gap_m` away, along the first part's own side `side` (quarter turns).
void lay_beside(Scene& scene, Mesh mesh, double gap_m, double turn_rad, double slide_m, Rng& rng) {
  const Pose& first = scene.parts.front().world_from_model;
  const Vec3d ahead =
      first.linear().col(0).head<2>().norm() > 0.5 ? first.linear().col(0) : first.linear().col(1);
  const double heading_rad = math::atan2(ahead.y(), ahead.x()) + turn_rad;
  const Mat3d turned = rotation_from_vector({0.0, 0.0, heading_rad});
  const Vec3d direction = turned.col(0);
  ScenePart part = make_part("beside", std::move(mesh), rng);
  part.world_from_model = rest_on_belt(part.mesh, Resting::Upright, 0.0, 0.0, heading_rad);
  const double away_m = reach_m(scene.parts.front(), direction) + gap_m + reach_m(part, -direction);
  const Vec3d middle(first.translation().x(), first.translation().y(), 0.0);
  const Vec3d along = direction * (away_m - direction.dot(middle));
  part.world_from_model.translation() += middle + along + slide_m * turned.col(1);
  scene.parts.push_back(std::move(part));
}

Mesh draw_clutter(Rng& rng) {
  const Vec3d size_m(rng.uniform(0.06, 0.16), rng.uniform(0.06, 0.16), rng.uniform(0.04, 0.12));
  return rng.below(2) == 0 ? make_box(size_m) : make_barrel({size_m.x(), size_m.x(), 0.1});
}

/// Held between camera and part: hides some of it.
void hold_above(Scene& scene, Rng& rng) {
  const ScenePart& part = scene.parts.front();
  ScenePart screen =
      make_part("screen", make_box({rng.uniform(0.2, 0.4), rng.uniform(0.08, 0.2), 0.02}), rng);
  const double height_m = reach_m(part, Vec3d::UnitZ()) + rng.uniform(0.06, 0.2);
  screen.world_from_model.linear() = rotation_from_vector({0.0, 0.0, rng.uniform(0.0, kTwoPi)});
  screen.world_from_model.translation() =
      part.world_from_model.translation() +
      Vec3d(rng.uniform(-0.15, 0.15), rng.uniform(-0.12, 0.12), 0.0);
  screen.world_from_model.translation().z() = height_m;
  scene.parts.push_back(std::move(screen));
}

void reach_in(Scene& scene, Rng& rng) {
  ScenePart arm = make_part("arm", make_arm(), rng);
  arm.world_from_model.linear() = rotation_from_vector({0.0, 0.0, rng.uniform(0.0, kTwoPi)}) *
                                  rotation_from_vector({0.0, rng.uniform(-0.4, 0.4), 0.0}) *
                                  rotation_from_vector({rng.uniform(-0.6, 0.6), 0.0, 0.0});
  arm.world_from_model.translation() =
      Vec3d(rng.uniform(-0.25, 0.25), rng.uniform(-0.2, 0.2), rng.uniform(0.12, 0.35));
  scene.parts.push_back(std::move(arm));
}

/// Whether some size differs by at least 8 %, whichever way the two lie.
bool differs(const PartInstance& a, const PartInstance& b) {
  Vec3d sizes[2] = {a.size_m, b.size_m};
  for (Vec3d& size_m : sizes) std::sort(size_m.data(), size_m.data() + 3);
  return (sizes[1].cwiseQuotient(sizes[0]) - Vec3d::Ones()).cwiseAbs().maxCoeff() >= 0.08;
}

PartInstance draw_other(const PartInstance& instance, PartClass part, Rng& rng) {
  for (;;) {
    PartInstance other = draw_instance(part, rng);
    if (differs(instance, other)) return other;
  }
}

PartClass draw_other_class(PartClass part, Rng& rng) {
  const auto own = static_cast<std::uint32_t>(part);
  return static_cast<PartClass>((own + 1 + rng.below(kPartClasses - 1)) % kPartClasses);
}

void lay_wrong_part(const PartInstance& instance, SceneKind kind, Scene& scene, Rng& rng) {
  PartInstance wrong = instance;
  if (kind == SceneKind::OtherKind || kind == SceneKind::OtherSize) {
    const bool same = kind == SceneKind::OtherSize;
    wrong = draw_other(instance, same ? instance.part : draw_other_class(instance.part, rng), rng);
  }
  if (kind == SceneKind::Larger) wrong.mesh = scaled(instance.mesh, 1.1);
  if (kind == SceneKind::Mirrored) wrong.mesh = mirrored(instance.mesh);
  const Resting resting = draw_resting(wrong.part, rng);
  scene.parts.push_back(lay_down("wrong", std::move(wrong.mesh), resting, rng));
}

}  // namespace

QualificationScene draw_scene(const PartInstance& instance, SceneKind kind, Rng rng) {
  QualificationScene drawn;
  Scene& scene = drawn.scene;
  draw_camera(scene, rng);
  drawn.has_part = kind <= SceneKind::Touching;
  if (!drawn.has_part) {
    if (kind == SceneKind::Arm) {
      reach_in(scene, rng);
    } else if (kind != SceneKind::Empty) {
      lay_wrong_part(instance, kind, scene, rng);
    }
    return drawn;
  }
  const Resting resting = draw_resting(instance.part, rng);
  scene.parts.push_back(lay_down("part", instance.mesh, resting, rng));
  const bool one_side_tells =
      instance.part == PartClass::NearlySymmetric || instance.part == PartClass::Sack;
  drawn.telling_side_up = !one_side_tells || resting == Resting::Upright;
  if (kind == SceneKind::HalfHidden) hold_above(scene, rng);
  if (kind == SceneKind::Cluttered) {
    lay_beside(scene, draw_clutter(rng), rng.uniform(0.05, 0.15), rng.uniform(0.0, kTwoPi),
               rng.uniform(-0.1, 0.1), rng);
  }
  if (kind == SceneKind::Touching) {
    PartInstance other = draw_other(instance, draw_other_class(instance.part, rng), rng);
    lay_beside(scene, std::move(other.mesh), rng.uniform(0.0, 0.003),
               kQuarterTurn * static_cast<double>(rng.below(4)), rng.uniform(-0.08, 0.08), rng);
  }
  return drawn;
}

bool usable(SceneKind kind, double visible_ratio, bool inside) noexcept {
  if (!inside) return false;
  if (kind == SceneKind::HalfHidden) return visible_ratio >= 0.33 && visible_ratio <= 0.8;
  return visible_ratio >= 0.95;
}

}  // namespace grapnel
