#include <algorithm>
#include <cmath>
#include <utility>

#include "base/cloud_file.h"
#include "base/config.h"
#include "base/math.h"
#include "base/rng.h"
#include "drivers/synthetic/scene.h"

namespace grapnel {
namespace {

constexpr double kMaxRigidError = 1e-6;
constexpr std::int64_t kMaxFrames = 1'000'000;
constexpr int kMaxStations = 10'000;
// Attempts to find a free place for one randomly placed thing before it is refused.
constexpr int kPlacements = 200;

const Field kCameraFields[] = {
    number_field<&SceneCamera::width>("width", "px", 16, 4096, "columns of the depth image"),
    number_field<&SceneCamera::height>("height", "px", 16, 4096, "rows of the depth image"),
    number_field<&SceneCamera::fx>("fx", "px", 10, 10000, "focal length along the rows"),
    number_field<&SceneCamera::fy>("fy", "px", 10, 10000, "focal length along the columns"),
    number_field<&SceneCamera::cx>("cx", "px", -4096, 8192, "column of the principal point"),
    number_field<&SceneCamera::cy>("cy", "px", -4096, 8192, "row of the principal point"),
    number_field<&SceneCamera::baseline_m>("baseline_m", "m", 0.001, 1.0,
                                           "from the camera to its projector, along +u"),
    number_field<&SceneCamera::metres_per_unit>("metres_per_unit", "m", 1e-6, 0.1,
                                                "depth of one count"),
    number_field<&SceneCamera::x_m>("x_m", "m", -10, 10, "place along the belt"),
    number_field<&SceneCamera::y_m>("y_m", "m", -10, 10, "place across the belt"),
    number_field<&SceneCamera::height_m>("height_m", "m", 0.1, 10, "height above the belt"),
    number_field<&SceneCamera::tilt_rad>("tilt_rad", "rad", -1.0, 1.0,
                                         "turned about the image's u axis; 0 looks straight down"),
    bool_field<&SceneCamera::color>("color", "make colour images too"),
    text_field<&SceneCamera::serial>("serial", "serial number that the camera gives"),
};

const Field kBeltFields[] = {
    number_field<&Belt::speed_m_s>("speed_m_s", "m/s", -5, 5, "speed of a belt without stations"),
    number_field<&Belt::pitch_m>("pitch_m", "m", 0, 100, "distance of stations; 0: runs on"),
    number_field<&Belt::dwell_frames>("dwell_frames", "", 1, 100000, "frames at rest per station"),
    number_field<&Belt::move_frames>("move_frames", "", 0, 100000, "frames in motion per station"),
    number_field<&Belt::stations>("stations", "", 1, kMaxStations,
                                  "stations until the first comes round again"),
    number_field<&Belt::albedo>("albedo", "", 0, 1, "infrared reflectance"),
};

const Field kSceneFields[] = {
    text_field<&Scene::name>("name", "name for people"),
    number_field<&Scene::seed>("seed", "", 0, 9e15, "of everything random"),
    number_field<&Scene::frames>("frames", "", 1, static_cast<double>(kMaxFrames),
                                 "length of a recording"),
    number_field<&Scene::rate_hz>("rate_hz", "Hz", 0.1, 1000, "frames per second"),
};

const Field kFaultFields[] = {
    choice_field<&SceneFault::kind>("kind", kFaultKindNames, "what goes wrong"),
    number_field<&SceneFault::at_frame>("at_frame", "", 0, static_cast<double>(kMaxFrames),
                                        "first frame it happens to"),
    number_field<&SceneFault::frames>("frames", "", 0, static_cast<double>(kMaxFrames),
                                      "frame times it lasts"),
};

/// Keys that [[part]] and [[random]] share.
struct PartKeys {
  std::string name;
  std::string model;
  PartKind kind = PartKind::Box;
  double albedo = 0.6;
  int station = 0;
  std::uint64_t seed = kModelSackSeed;
  std::string mesh;
};

const Field kPartFields[] = {
    text_field<&PartKeys::name>("name", "name of this part; by default its kind and number"),
    text_field<&PartKeys::model>("model", "model it is an instance of; \"\" for clutter"),
    choice_field<&PartKeys::kind>("kind", kPartKindNames, "its shape"),
    number_field<&PartKeys::albedo>("albedo", "", 0, 1, "infrared reflectance; rubber has 0.03"),
    number_field<&PartKeys::station>("station", "", 0, kMaxStations - 1, "station it lies at"),
    number_field<&PartKeys::seed>("seed", "", 0, 9e15, "of a sack's wrinkles"),
    text_field<&PartKeys::mesh>("mesh", "PLY file of kind \"mesh\", metres"),
};

Vec3d read_size(ConfigReader& reader, std::string_view key, const Vec3d& fallback) {
  const std::vector<double> numbers = reader.take_numbers(key, 3);
  if (numbers.empty()) return fallback;
  for (const double number : numbers) {
    if (!(number >= 0.005 && number <= 10.0)) {
      throw reader.problem(key, "0.005 to 10 m is allowed for each of the three sizes");
    }
  }
  return {numbers[0], numbers[1], numbers[2]};
}

Mesh read_part_mesh(ConfigReader& reader, const std::filesystem::path& folder,
                    const std::string& file) {
  if (file.empty()) throw reader.problem("mesh", "kind \"mesh\" needs a file");
  const MeshData data = read_mesh(folder / file);
  Mesh mesh;
  for (const Vec3f& vertex : data.vertices) mesh.add_vertex(vertex.cast<double>());
  mesh.triangles = data.triangles;
  return mesh;
}

Mesh make_part_mesh(ConfigReader& reader, const std::filesystem::path& folder, const PartKeys& keys,
                    const Vec3d& size_m) {
  if (keys.kind == PartKind::Mesh) return read_part_mesh(reader, folder, keys.mesh);
  if (!keys.mesh.empty()) throw reader.problem("mesh", "only kind \"mesh\" takes a file");
  return make_shape(keys.kind, size_m, keys.seed);
}

void check_station(const ConfigReader& reader, const Scene& scene, int station) {
  if (station < scene.belt.stations) return;
  throw reader.problem("station", std::to_string(station) + " is not allowed; 0 to " +
                                      std::to_string(scene.belt.stations - 1) +
                                      " is (belt.stations)");
}

std::string default_name(const Scene& scene, PartKind kind) {
  return std::string(kPartKindNames[static_cast<std::size_t>(kind)]) + "-" +
         std::to_string(scene.parts.size());
}

void read_part(const ConfigTable& table, const std::filesystem::path& folder, Scene& scene) {
  ConfigReader reader(table);
  PartKeys keys;
  reader.take_fields(kPartFields, &keys);
  check_station(reader, scene, keys.station);
  ScenePart part;
  part.name = keys.name.empty() ? default_name(scene, keys.kind) : keys.name;
  part.model = keys.model;
  part.kind = keys.kind;
  part.albedo = keys.albedo;
  part.station = keys.station;
  part.mesh =
      make_part_mesh(reader, folder, keys, read_size(reader, "size_m", default_size_m(keys.kind)));
  const double x_m = reader.take_number("x_m", -100.0, 100.0, 0.0);
  const double y_m = reader.take_number("y_m", -100.0, 100.0, 0.0);
  const double yaw_rad = reader.take_number("yaw_rad", -7.0, 7.0, 0.0);
  const std::string resting = reader.take_text("resting", "upright");
  const auto found = std::find(std::begin(kRestingNames), std::end(kRestingNames), resting);
  if (found == std::end(kRestingNames)) {
    throw reader.problem("resting", "\"" + resting +
                                        "\" is not allowed; one of \"upright\", \"upside_down\", "
                                        "\"on_side\", \"on_end\" is");
  }
  const std::vector<double> matrix = reader.take_numbers("world_from_model", 16);
  if (matrix.empty()) {
    part.world_from_model = rest_on_belt(
        part.mesh, static_cast<Resting>(found - std::begin(kRestingNames)), x_m, y_m, yaw_rad);
  } else {
    const Mat4d pose =
        Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(matrix.data());
    if (!is_rigid(pose, kMaxRigidError)) {
      throw reader.problem("world_from_model", "is not a rotation with a translation");
    }
    part.world_from_model.matrix() = pose;
  }
  reader.finish();
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

/// `count` things at each of `stations` stations from `station` on, at random free places.
void read_random(const ConfigTable& table, const std::filesystem::path& folder, Scene& scene,
                 Rng rng) {
  ConfigReader reader(table);
  PartKeys keys;
  reader.take_fields(kPartFields, &keys);
  const auto stations = static_cast<int>(reader.take_integer("stations", 1, kMaxStations, 1));
  const std::int64_t count = reader.take_integer("count", 1, 100, 1);
  check_station(reader, scene, keys.station + stations - 1);
  const Vec3d low_m = read_size(reader, "size_m", default_size_m(keys.kind));
  const Vec3d high_m = read_size(reader, "size_high_m", low_m);
  std::vector<double> region_m = reader.take_numbers("region_m", 4);
  if (region_m.empty()) region_m = {-0.15, 0.15, -0.10, 0.10};
  const bool event = reader.take_bool("event", false);
  for (int station = keys.station; station < keys.station + stations; ++station) {
    for (std::int64_t i = 0; i < count; ++i) {
      Vec3d size_m;
      for (int axis = 0; axis < 3; ++axis) size_m[axis] = rng.uniform(low_m[axis], high_m[axis]);
      ScenePart part;
      part.name = (keys.name.empty() ? default_name(scene, keys.kind)
                                     : keys.name + "-" + std::to_string(scene.parts.size()));
      part.model = keys.model;
      part.kind = keys.kind;
      part.albedo = keys.albedo;
      part.station = station;
      part.mesh = make_part_mesh(reader, folder, keys, size_m);
      place_randomly(reader, scene, std::move(part), region_m, rng);
      if (!event) continue;
      const std::string kind(kPartKindNames[static_cast<std::size_t>(keys.kind)]);
      scene.events.push_back({kind, keys.model, "accept", station, scene.parts.back().name});
    }
  }
  reader.finish();
}

void read_event(const ConfigTable& table, Scene& scene) {
  ConfigReader reader(table);
  SceneEvent event;
  event.kind = reader.take_text("kind", "");
  event.model = reader.take_text("model", "");
  event.expected = reader.take_text("expected", "accept");
  event.part = reader.take_text("part", "");
  event.station = static_cast<int>(reader.take_integer("station", 0, kMaxStations - 1, 0));
  check_station(reader, scene, event.station);
  if (event.expected != "accept" && event.expected != "empty" && event.expected != "wrong") {
    throw reader.problem("expected", "\"" + event.expected +
                                         "\" is not allowed; one of \"accept\", \"empty\", "
                                         "\"wrong\" is");
  }
  const bool known =
      event.part.empty() || std::any_of(scene.parts.begin(), scene.parts.end(),
                                        [&](const ScenePart& p) { return p.name == event.part; });
  if (!known) throw reader.problem("part", "no part is named \"" + event.part + "\"");
  if (event.expected == "accept" && event.part.empty()) {
    throw reader.problem("part", "an event that expects \"accept\" names its part");
  }
  reader.finish();
  scene.events.push_back(std::move(event));
}

}  // namespace

FieldTable scene_camera_fields() { return kCameraFields; }
FieldTable belt_fields() { return kBeltFields; }

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
  take_section("scene", kSceneFields, &scene);
  take_section("camera", kCameraFields, &scene.camera);
  take_section("belt", kBeltFields, &scene.belt);
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
    section.take_fields(kFaultFields, &fault);
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
