#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string_view>
#include <utility>

#include "base/cloud_file.h"
#include "base/formats/ply_body.h"

namespace grapnel {
namespace {

/// What a vertex property is to us.
enum class Role : std::uint8_t {
  X,
  Y,
  Z,
  Nx,
  Ny,
  Nz,
  Red,
  Green,
  Blue,
  Intensity,
  Curvature,
  Label,
  kCount
};
constexpr std::size_t kRoles = static_cast<std::size_t>(Role::kCount);

constexpr std::array<std::pair<std::string_view, Role>, 21> kRoleNames = {{
    {"x", Role::X},
    {"y", Role::Y},
    {"z", Role::Z},
    {"nx", Role::Nx},
    {"ny", Role::Ny},
    {"nz", Role::Nz},
    {"normal_x", Role::Nx},
    {"normal_y", Role::Ny},
    {"normal_z", Role::Nz},
    {"red", Role::Red},
    {"green", Role::Green},
    {"blue", Role::Blue},
    {"r", Role::Red},
    {"g", Role::Green},
    {"b", Role::Blue},
    {"diffuse_red", Role::Red},
    {"diffuse_green", Role::Green},
    {"diffuse_blue", Role::Blue},
    {"intensity", Role::Intensity},
    {"curvature", Role::Curvature},
    {"label", Role::Label},
}};

Role role_of(const PlyProperty& property) noexcept {
  if (property.is_list) return Role::kCount;
  for (const auto& [name, role] : kRoleNames) {
    if (name == property.name) return role;
  }
  return Role::kCount;
}

void skip(PlyBody& body, const PlyProperty& property) {
  const std::size_t count = property.is_list ? body.next_count(property.count_type) : 1;
  for (std::size_t i = 0; i < count; ++i) body.next(property.type);
}

/// The vertex element's rows, read property by property.
class Vertices {
 public:
  explicit Vertices(const PlyElement& element) : element_(element) {
    for (const PlyProperty& property : element.properties) {
      const Role role = role_of(property);
      roles_.push_back(role);
      if (role != Role::kCount) type_[index(role)] = property.type;
      if (role != Role::kCount) present_[index(role)] = true;
    }
  }

  [[nodiscard]] bool has(Role first, Role last) const noexcept {
    for (std::size_t i = index(first); i <= index(last); ++i) {
      if (!present_[i]) return false;
    }
    return true;
  }
  void read_row(PlyBody& body) {
    for (std::size_t i = 0; i < roles_.size(); ++i) {
      const PlyProperty& property = element_.properties[i];
      if (roles_[i] == Role::kCount) {
        skip(body, property);
      } else {
        row_[index(roles_[i])] = body.next(property.type);
      }
    }
  }
  [[nodiscard]] float real(Role role) const noexcept {
    return static_cast<float>(row_[index(role)]);
  }
  [[nodiscard]] Rgb8 color() const noexcept {
    return {channel(Role::Red), channel(Role::Green), channel(Role::Blue)};
  }
  [[nodiscard]] std::uint32_t label() const noexcept {
    const double value = row_[index(Role::Label)];
    return value >= 0.0 && value <= 4294967295.0 ? static_cast<std::uint32_t>(value) : 0;
  }

 private:
  static constexpr std::size_t index(Role role) noexcept { return static_cast<std::size_t>(role); }
  // Real channels run from 0 to 1, 16-bit ones to 65535, all others to 255.
  [[nodiscard]] std::uint8_t channel(Role role) const noexcept {
    double value = row_[index(role)];
    const PlyType type = type_[index(role)];
    if (ply_type_is_real(type)) value *= 255.0;
    if (type == PlyType::UInt16) value /= 257.0;
    if (!(value > 0.0)) return 0;
    return value >= 255.0 ? 255 : static_cast<std::uint8_t>(value + 0.5);
  }

  const PlyElement& element_;
  std::vector<Role> roles_;
  std::array<PlyType, kRoles> type_{};
  std::array<bool, kRoles> present_{};
  std::array<double, kRoles> row_{};
};

void require_position(const PlyBody& body, const Vertices& vertices) {
  if (!vertices.has(Role::X, Role::Z)) {
    throw body.problem("element \"vertex\" lacks one of the properties x, y, z");
  }
}

CloudData read_vertices(PlyBody& body, const PlyElement& element) {
  Vertices vertices(element);
  require_position(body, vertices);
  const bool normals = vertices.has(Role::Nx, Role::Nz);
  const bool colors = vertices.has(Role::Red, Role::Blue);
  const bool intensity = vertices.has(Role::Intensity, Role::Intensity);
  const bool curvature = vertices.has(Role::Curvature, Role::Curvature);
  const bool label = vertices.has(Role::Label, Role::Label);
  CloudData cloud;
  cloud.width = static_cast<int>(element.count);
  for (std::vector<float>* part : {&cloud.x, &cloud.y, &cloud.z}) part->reserve(element.count);
  for (std::size_t i = 0; i < element.count; ++i) {
    vertices.read_row(body);
    const float x = vertices.real(Role::X);
    const float y = vertices.real(Role::Y);
    const float z = vertices.real(Role::Z);
    const bool read = std::isfinite(x) && std::isfinite(y) && std::isfinite(z);
    constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
    cloud.x.push_back(read ? x : kNone);
    cloud.y.push_back(read ? y : kNone);
    cloud.z.push_back(read ? z : kNone);
    if (normals) {
      cloud.nx.push_back(vertices.real(Role::Nx));
      cloud.ny.push_back(vertices.real(Role::Ny));
      cloud.nz.push_back(vertices.real(Role::Nz));
    }
    if (colors) cloud.color.push_back(vertices.color());
    if (intensity) cloud.intensity.push_back(vertices.real(Role::Intensity));
    if (curvature) cloud.curvature.push_back(vertices.real(Role::Curvature));
    if (label) cloud.label.push_back(vertices.label());
  }
  return cloud;
}

std::uint32_t next_index(PlyBody& body, PlyType type, std::size_t vertices) {
  const double index = body.next(type);
  if (!(index >= 0.0 && index < static_cast<double>(vertices)) || index != std::floor(index)) {
    throw body.problem("a face names a vertex outside 0 to " + std::to_string(vertices) + " - 1");
  }
  return static_cast<std::uint32_t>(index);
}

void read_polygon(PlyBody& body, const PlyProperty& property, std::size_t vertices,
                  MeshData& mesh) {
  const std::size_t corners = body.next_count(property.count_type);
  std::uint32_t first = 0;
  std::uint32_t previous = 0;
  for (std::size_t i = 0; i < corners; ++i) {
    const std::uint32_t corner = next_index(body, property.type, vertices);
    if (i == 0) first = corner;
    if (i >= 2) mesh.triangles.push_back({first, previous, corner});
    previous = corner;
  }
}

void read_faces(PlyBody& body, const PlyElement& element, std::size_t vertices, MeshData& mesh) {
  for (std::size_t i = 0; i < element.count; ++i) {
    for (const PlyProperty& property : element.properties) {
      const bool corners = property.is_list &&
                           (property.name == "vertex_indices" || property.name == "vertex_index");
      if (corners) {
        read_polygon(body, property, vertices, mesh);
      } else {
        skip(body, property);
      }
    }
  }
}

void skip_element(PlyBody& body, const PlyElement& element) {
  for (std::size_t i = 0; i < element.count; ++i) {
    for (const PlyProperty& property : element.properties) skip(body, property);
  }
}

TextScanner scan(std::span<const std::byte> bytes, const std::string& name) {
  return {{reinterpret_cast<const char*>(bytes.data()), bytes.size()}, name};
}

}  // namespace

CloudData parse_ply(std::span<const std::byte> bytes, const std::string& name) {
  TextScanner scanner = scan(bytes, name);
  const PlyHeader header = read_ply_header(scanner);
  PlyBody body(bytes, header.data, scanner);
  for (const PlyElement& element : header.elements) {
    if (element.name == "vertex") return read_vertices(body, element);
    skip_element(body, element);
  }
  throw body.problem("there is no element \"vertex\"");
}

MeshData parse_ply_mesh(std::span<const std::byte> bytes, const std::string& name) {
  TextScanner scanner = scan(bytes, name);
  const PlyHeader header = read_ply_header(scanner);
  PlyBody body(bytes, header.data, scanner);
  MeshData mesh;
  for (const PlyElement& element : header.elements) {
    if (element.name == "vertex") {
      const CloudData cloud = read_vertices(body, element);
      mesh.vertices.reserve(cloud.size());
      for (std::size_t i = 0; i < cloud.size(); ++i) {
        if (!std::isfinite(cloud.x[i])) throw body.problem("a mesh's vertex is not finite");
        mesh.vertices.emplace_back(cloud.x[i], cloud.y[i], cloud.z[i]);
      }
      mesh.color = cloud.color;
    } else if (element.name == "face") {
      read_faces(body, element, mesh.vertices.size(), mesh);
    } else {
      skip_element(body, element);
    }
  }
  if (mesh.triangles.empty()) throw body.problem("the file holds no face");
  return mesh;
}

}  // namespace grapnel
