#include "pipeline/model.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <fstream>
#include <limits>

#include "base/arena.h"
#include "base/cloud_file.h"
#include "base/config.h"
#include "base/hash.h"
#include "base/input_error.h"
#include "pipeline/limits.h"
#include "pipeline/model_normals.h"

namespace grapnel {
namespace {

constexpr std::size_t kFewestPoints = 32;
// A part is neither a speck nor a building; outside of this the file's unit is wrong.
constexpr double kSmallest_m = 1e-5;
constexpr double kLargest_m = 100.0;

const std::vector<std::string> kDirections = {"x", "y", "z", "rx", "ry", "rz"};

std::vector<std::byte> read_bytes(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream) throw InputError(file.string() + ": can't be opened");
  std::vector<std::byte> bytes;
  std::array<char, 65536> block;
  while (stream.read(block.data(), block.size()) || stream.gcount() > 0) {
    const auto* first = reinterpret_cast<const std::byte*>(block.data());
    bytes.insert(bytes.end(), first, first + stream.gcount());
  }
  return bytes;
}

void take_points(const CloudData& cloud, double unit_m, Model& model) {
  const auto unit = static_cast<float>(unit_m);
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    if (!std::isfinite(cloud.x[i]) || !std::isfinite(cloud.y[i]) || !std::isfinite(cloud.z[i])) {
      continue;
    }
    Vec3f normal = Vec3f::Zero();
    if (cloud.has_normals()) {
      normal = Vec3f(cloud.nx[i], cloud.ny[i], cloud.nz[i]);
      const float length = normal.norm();
      if (!(length > 0.5F && length < 2.0F)) continue;
      normal /= length;
    }
    model.x.push_back(cloud.x[i] * unit);
    model.y.push_back(cloud.y[i] * unit);
    model.z.push_back(cloud.z[i] * unit);
    model.nx.push_back(normal.x());
    model.ny.push_back(normal.y());
    model.nz.push_back(normal.z());
    if (cloud.has_intensity()) {
      model.intensity.push_back(cloud.intensity[i]);
    } else if (cloud.has_color()) {
      const Rgb8& c = cloud.color[i];
      model.intensity.push_back((0.299F * c.r + 0.587F * c.g + 0.114F * c.b) / 255.0F);
    }
  }
}

Pose pose_from(const std::vector<double>& numbers, const ConfigReader& reader) {
  Mat4d matrix = Mat4d::Identity();
  for (int i = 0; i < 16 && !numbers.empty(); ++i) {
    matrix(i / 4, i % 4) = numbers[static_cast<std::size_t>(i)];
  }
  if (!is_rigid(matrix, 1e-3)) {
    throw reader.problem("model_from_grasp", "not a rotation and a translation");
  }
  return Pose(matrix);
}

std::vector<Grasp> take_grasps(ConfigReader& reader) {
  std::vector<Grasp> grasps;
  for (const ConfigTable* table : reader.take_tables("grasp")) {
    ConfigReader entry(*table);
    Grasp grasp;
    grasp.id = static_cast<std::uint16_t>(
        entry.take_integer("id", 0, 65535, static_cast<std::int64_t>(grasps.size())));
    grasp.name = entry.take_text("name", "");
    grasp.model_from_grasp = pose_from(entry.take_numbers("model_from_grasp", 16), entry);
    grasp.required = entry.take_texts("required");
    for (const std::string& direction : grasp.required) {
      if (std::find(kDirections.begin(), kDirections.end(), direction) == kDirections.end()) {
        throw entry.problem("required", "\"" + direction + "\"; allowed: x, y, z, rx, ry, rz");
      }
    }
    for (const Grasp& other : grasps) {
      if (other.id == grasp.id) throw entry.problem("id", "is used twice");
    }
    entry.finish();
    grasps.push_back(std::move(grasp));
  }
  return grasps;
}

struct Description {
  double unit_m = 1.0;
  std::uint16_t id = 0;
  Symmetry symmetry = Symmetry::None;
  std::vector<Grasp> grasps;
};

Description read_description(const std::filesystem::path& file) {
  const ConfigTable table = load_config(file);
  ConfigReader reader(table);
  Description description;
  description.unit_m = reader.take_number("unit_m", 1e-9, 1000.0, 1.0);
  description.id = static_cast<std::uint16_t>(reader.take_integer("id", 0, 65535, 0));
  const std::string symmetry = reader.take_text("symmetry", "none");
  try {
    description.symmetry = symmetry_from_name(symmetry);
  } catch (const InputError& error) {
    throw reader.problem("symmetry", error.what());
  }
  description.grasps = take_grasps(reader);
  reader.take_text("made_by", "");
  reader.take_text("description", "");
  reader.take_text("name", "");
  reader.take_numbers("size_m", 0);
  reader.finish();
  return description;
}

}  // namespace

Model model_from_cloud(const CloudData& cloud, const std::string& name, double unit_m) {
  Model model;
  model.name = name;
  take_points(cloud, unit_m, model);
  if (model.size() < kFewestPoints) {
    throw InputError(name + ": " + std::to_string(model.size()) + " usable points; at least " +
                     std::to_string(kFewestPoints) + " are needed");
  }
  Vec3d low = Vec3d::Constant(std::numeric_limits<double>::max());
  Vec3d high = -low;
  for (std::size_t i = 0; i < model.size(); ++i) {
    const Vec3d p(model.x[i], model.y[i], model.z[i]);
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  model.diameter_m = (high - low).norm();
  if (!(model.diameter_m >= kSmallest_m && model.diameter_m <= kLargest_m)) {
    throw InputError(name + ": diameter " + std::to_string(model.diameter_m) +
                     " m; 0.00001 m to 100 m is plausible: is the unit right?");
  }
  model.spacing_m = mean_nearest_distance_m(model);
  if (!cloud.has_normals()) estimate_model_normals(model);
  model.hash = hash_bytes(
      std::as_bytes(std::span(model.x)),
      hash_bytes(std::as_bytes(std::span(model.y)), hash_bytes(std::as_bytes(std::span(model.z)))));
  model.grasps.push_back({});
  return model;
}

Model load_model(const std::filesystem::path& file) {
  const std::vector<std::byte> bytes = read_bytes(file);
  std::filesystem::path description_file = file;
  description_file.replace_extension(".toml");
  Description description;
  std::uint64_t hash = hash_bytes(bytes);
  if (std::filesystem::exists(description_file)) {
    description = read_description(description_file);
    hash = hash_bytes(read_bytes(description_file), hash);
  }
  Model model;
  try {
    model = model_from_cloud(parse_cloud(bytes, file.string()), file.stem().string(),
                             description.unit_m);
  } catch (const InputError& error) {
    const std::string text = error.what();
    throw InputError(text.starts_with(file.string()) ? text : file.string() + ": " + text);
  }
  model.id = description.id;
  model.symmetry = description.symmetry;
  if (!description.grasps.empty()) model.grasps = description.grasps;
  model.hash = hash;
  return model;
}

}  // namespace grapnel
