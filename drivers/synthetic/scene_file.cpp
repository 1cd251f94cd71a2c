#include <algorithm>
#include <cmath>
#include <utility>

#include "base/cloud_file.h"
#include "base/config.h"
#include "base/math.h"
#include "base/rng.h"
#include "drivers/synthetic/scene.h"
#include "drivers/synthetic/scene_keys.h"

namespace grapnel {
namespace {

constexpr double kMaxRigidError = 1e-6;
// Attempts to find a free place for one randomly placed thing before it is refused.
constexpr int kPlacements = 200;

void check_count(const ConfigReader& reader, std::string_view key,
                 const std::vector<double>& numbers, std::size_t count) {
  if (numbers.size() == count || !reader.has(key)) return;
  throw reader.problem(key, "a list of " + std::to_string(numbers.size()) +
                                " is not allowed; a list of " + std::to_string(count) +
                                " numbers is");
}

Vec3d size_or(const std::vector<double>& numbers, const Vec3d& fallback) {
  return numbers.empty() ? fallback : Vec3d(numbers[0], numbers[1], numbers[2]);
}

Mesh make_part_mesh(const ConfigReader& reader, const std::filesystem::path& folder,
                    const PartKeys& keys, const Vec3d& size_m) {
  if (keys.kind != PartKind::Mesh) {
    if (!keys.mesh.empty()) throw reader.problem("mesh", "only kind \"mesh\" takes a file");
    return make_shape(keys.kind, size_m, keys.seed);
  }
  if (keys.mesh.empty()) throw reader.problem("mesh", "kind \"mesh\" needs a file");
  const MeshData data = read_mesh(folder / keys.mesh);
  Mesh mesh;
  for (const Vec3f& vertex : data.vertices) mesh.add_vertex(vertex.cast<double>());
  mesh.triangles = data.triangles;
  return mesh;
}

void check_station(const ConfigReader& reader, const Scene& scene, int station) {
  if (station < scene.belt.stations) return;
  throw reader.problem("station", std::to_string(station) + " is not allowed; 0 to " +
                                      std::to_string(scene.belt.stations - 1) +
                                      " is (belt.stations)");
}

std::string kind_name(PartKind kind) {
  return std::string(kPartKindNames[static_cast<std::size_t>(kind)]);
}

/// A part of these keys that lies nowhere yet.
ScenePart part_of(const PartKeys& keys, const std::string& name, Mesh mesh) {
  ScenePart part;
  part.name = name;
  part.model = keys.model;
  part.kind = keys.kind;
  part.albedo = keys.albedo;
  part.station = keys.station;
  part.mesh = std::move(mesh);
  return part;
}

Pose place_of(const ConfigReader& reader, const PlaceKeys& place, const Mesh& mesh) {
  if (place.world_from_model.empty()) {
    return rest_on_belt(mesh, place.resting, place.x_m, place.y_m, place.yaw_rad);
  }
  const Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>> rows(
      place.world_from_model.data());
  if (!is_rigid(rows, kMaxRigidError)) {
    throw reader.problem("world_from_model", "is not a rotation with a translation");
  }
  Pose pose;
  pose.matrix() = rows;
  return pose;
}

void read_part(const ConfigTable& table, const std::filesystem::path& folder, Scene& scene) {
  ConfigReader reader(table);
  PartKeys keys;
  PlaceKeys place;
  reader.take_fields(PartKeys::fields(), &keys);
  reader.take_fields(PlaceKeys::fields(), &place);
  reader.finish();
  check_count(reader, "size_m", keys.size_m, 3);
  check_count(reader, "world_from_model", place.world_from_model, 16);
  check_station(reader, scene, keys.station);
  const std::string name = keys.name.empty()
                               ? kind_name(keys.kind) + "-" + std::to_string(scene.parts.size())
                               : keys.name;
  const Vec3d size_m = size_or(keys.size_m, default_size_m(keys.kind));
  ScenePart part = part_of(keys, name, make_part_mesh(reader, folder, keys, size_m));
  part.world_from_model = place_of(reader, place, part.mesh);
  scene.parts.push_back(std::move(part));
}

double circle_radius_m(const Mesh& mesh) {
  const Vec3d half = 0.5 * bounds_of(mesh).size_m();
  return std::sqrt(half.x() * half.x() + half.y() * half.y());
}

bool place_is_free(const Scene& scene, const ScenePart& part) {
  const double radius_m = circle_radius_m(part.mesh);
  for (const ScenePart& other : scene.parts) {
    if (other.station != part.station) continue;
    const Vec3d gap = other.world_from_model.translation() - part.world_from_model.translation();
    const double reach_m = radius_m + circle_radius_m(other.mesh);
    if (gap.x() * gap.x() + gap.y() * gap.y() < reach_m * reach_m) return false;
  }
  return true;
}

void place_randomly(const ConfigReader& reader, Scene& scene, ScenePart part,
                    const std::vector<double>& region_m, Rng& rng) {
  for (int attempt = 0; attempt < kPlacements; ++attempt) {
    const double x_m = rng.uniform(region_m[0], region_m[1]);
    const double y_m = rng.uniform(region_m[2], region_m[3]);
    part.world_from_model =
        rest_on_belt(part.mesh, Resting::Upright, x_m, y_m, rng.uniform(-math::kPi, math::kPi));
    if (!place_is_free(scene, part)) continue;
    scene.parts.push_back(std::move(part));
    return;
  }
  throw reader.problem("region_m",
                       "no free place is left in it at station " + std::to_string(part.station));
}

void read_random(const ConfigTable& table, const std::filesystem::path& folder, Scene& scene,
                 Rng rng) {
  ConfigReader reader(table);
  PartKeys keys;
  RandomKeys random;
  reader.take_fields(PartKeys::fields(), &keys);
  reader.take_fields(RandomKeys::fields(), &random);
  reader.finish();
  check_count(reader, "size_m", keys.size_m, 3);
  check_count(reader, "size_high_m", random.size_high_m, 3);
  check_count(reader, "region_m", random.region_m, 4);
  check_station(reader, scene, keys.station + random.stations - 1);
  const Vec3d low_m = size_or(keys.size_m, default_size_m(keys.kind));
  const Vec3d high_m = size_or(random.size_high_m, low_m);
  const std::string name = keys.name.empty() ? kind_name(keys.kind) : keys.name;
  const int last_station = keys.station + random.stations - 1;
  for (; keys.station <= last_station; ++keys.station) {
    for (int i = 0; i < random.count; ++i) {
      Vec3d size_m;
      for (int axis = 0; axis < 3; ++axis) size_m[axis] = rng.uniform(low_m[axis], high_m[axis]);
      place_randomly(reader, scene,
                     part_of(keys, name + "-" + std::to_string(scene.parts.size()),
                             make_part_mesh(reader, folder, keys, size_m)),
                     random.region_m, rng);
      if (!random.event) continue;
      scene.events.push_back({kind_name(keys.kind), keys.model, Expectation::Accept, keys.station,
                              scene.parts.back().name});
    }
  }
}

void read_event(const ConfigTable& table, Scene& scene) {
  ConfigReader reader(table);
  SceneEvent event;
  reader.take_fields(scene_event_fields(), &event);
  reader.finish();
  check_station(reader, scene, event.station);
  const bool known =
      event.part.empty() || std::any_of(scene.parts.begin(), scene.parts.end(),
                                        [&](const ScenePart& p) { return p.name == event.part; });
  if (!known) throw reader.problem("part", "no part is named \"" + event.part + "\"");
  if (event.expected == Expectation::Accept && event.part.empty()) {
    throw reader.problem("part", "an event that expects \"accept\" names its part");
  }
  scene.events.push_back(std::move(event));
}

}  // namespace

Scene read_scene(const ConfigTable& root, const std::filesystem::path& folder) {
  Scene scene;
  ConfigReader reader(root);
  const auto take_section = [&reader](std::string_view key, FieldTable fields, void* object) {
    const ConfigTable* table = reader.take_table(key);
    if (table == nullptr) return;
    ConfigReader section(*table);
    section.take_fields(fields, object);
    section.finish();
  };
  take_section("scene", scene_fields(), &scene);
  take_section("camera", scene_camera_fields(), &scene.camera);
  take_section("belt", belt_fields(), &scene.belt);
  take_section("sensor", structured_light_fields(), &scene.sensor);
  for (const ConfigTable* table : reader.take_tables("part")) read_part(*table, folder, scene);
  std::uint64_t stream = 0;
  for (const ConfigTable* table : reader.take_tables("random")) {
    read_random(*table, folder, scene, Rng(scene.seed).split(++stream));
  }
  for (const ConfigTable* table : reader.take_tables("event")) read_event(*table, scene);
  for (const ConfigTable* table : reader.take_tables("fault")) {
    ConfigReader section(*table);
    SceneFault fault;
    section.require("kind");
    section.take_fields(scene_fault_fields(), &fault);
    section.finish();
    scene.faults.push_back(fault);
  }
  reader.finish();
  std::stable_sort(scene.events.begin(), scene.events.end(),
                   [](const auto& a, const auto& b) { return a.station < b.station; });
  return scene;
}

Scene load_scene(const std::filesystem::path& file) {
  return read_scene(load_config(file), file.parent_path());
}

}  // namespace grapnel
