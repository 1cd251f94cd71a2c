#include "drivers/synthetic/shipped_models.h"

#include <algorithm>
#include <limits>
#include <sstream>

#include "base/cloud_file.h"
#include "base/file.h"
#include "drivers/synthetic/mesh.h"
#include "drivers/synthetic/shapes.h"

namespace grapnel {
namespace {

// Two to three pixels at 1 m; 10 to 13 thousand points on parts of this size.
constexpr double kSpacing_m = 0.005;
constexpr std::uint64_t kSampleSeed = 20;

/// Height of the surface above the frame's origin.
double top_m(const Mesh& mesh) {
  double top = -std::numeric_limits<double>::infinity();
  for (const Mesh::Triangle& corner : mesh.triangles) {
    const Vec3d& a = mesh.vertices[corner[0]];
    const Vec3d ab = mesh.vertices[corner[1]] - a;
    const Vec3d ac = mesh.vertices[corner[2]] - a;
    const double area = ab.x() * ac.y() - ab.y() * ac.x();
    if (area == 0.0) continue;
    const double s = (a.y() * ac.x() - a.x() * ac.y()) / area;
    const double t = (ab.y() * a.x() - ab.x() * a.y()) / area;
    if (s >= 0.0 && t >= 0.0 && s + t <= 1.0) top = std::max(top, a.z() + s * ab.z() + t * ac.z());
  }
  return top;
}

CloudData cloud_of(const SurfaceSamples& samples) {
  CloudData cloud;
  for (std::size_t i = 0; i < samples.points_m.size(); ++i) {
    const Vec3f point = samples.points_m[i].cast<float>();
    const Vec3f normal = samples.normals[i].cast<float>();
    cloud.x.push_back(point.x());
    cloud.y.push_back(point.y());
    cloud.z.push_back(point.z());
    cloud.nx.push_back(normal.x());
    cloud.ny.push_back(normal.y());
    cloud.nz.push_back(normal.z());
  }
  cloud.width = static_cast<int>(cloud.size());
  return cloud;
}

std::string model_toml(const std::string& what, const Mesh& mesh, std::string_view symmetry) {
  std::ostringstream text;
  text.precision(6);
  text << "# " << what << ", a point every " << kSpacing_m * 1000.0 << " mm.\n"
       << "unit_m = 1.0\n"
       << "symmetry = \"" << symmetry << "\"\n\n"
       << "# A suction gripper from above: z of the grasp's frame points into the part.\n"
       << "[[grasp]]\n"
       << "id = 1\n"
       << "name = \"top\"\n"
       << "model_from_grasp = [\n"
       << "  1.0, 0.0, 0.0, 0.0,\n"
       << "  0.0, -1.0, 0.0, 0.0,\n"
       << "  0.0, 0.0, -1.0, " << top_m(mesh) << ",\n"
       << "  0.0, 0.0, 0.0, 1.0,\n"
       << "]\n";
  const bool turns_freely = symmetry == symmetry_name(PartKind::Barrel);
  text << "required = [\"x\", \"y\", \"z\", \"rx\", \"ry\"" << (turns_freely ? "" : ", \"rz\"")
       << "]\n";
  return text.str();
}

std::string what_ships(PartKind kind) {
  const Vec3d size_m = default_size_m(kind);
  std::ostringstream text;
  text.precision(6);
  text << "Made by grapnel-make-models: procedural "
       << kPartKindNames[static_cast<std::size_t>(kind)] << ", " << size_m.x() << " x "
       << size_m.y() << " x " << size_m.z() << " m";
  return text.str();
}

}  // namespace

ShippedModel make_model(const std::string& name, const std::string& what, const Mesh& mesh,
                        std::string_view symmetry) {
  return {name, cloud_of(sample_surface(mesh, kSpacing_m, kSampleSeed)),
          model_toml(what, mesh, symmetry)};
}

std::vector<ShippedModel> make_shipped_models() {
  std::vector<ShippedModel> models;
  for (const PartKind kind : {PartKind::Box, PartKind::Carton, PartKind::Barrel, PartKind::Sack}) {
    const Mesh mesh = make_shape(kind, default_size_m(kind), kModelSackSeed);
    models.push_back(make_model(std::string(kPartKindNames[static_cast<std::size_t>(kind)]),
                                what_ships(kind), mesh, symmetry_name(kind)));
  }
  return models;
}

void write_models(const std::vector<ShippedModel>& models, const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder);
  for (const ShippedModel& model : models) {
    write_ply(folder / (model.name + ".ply"), model.cloud);
    write_file(folder / (model.name + ".toml"), std::string_view(model.toml));
  }
}

}  // namespace grapnel
