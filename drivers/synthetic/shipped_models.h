#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "base/cloud.h"
#include "drivers/synthetic/mesh.h"

namespace grapnel {

/// A model as Grapnel ships it: a cloud with outward normals, and what its .toml says.
struct ShippedModel {
  std::string name;
  CloudData cloud;
  std::string toml;
};

/// A model of a mesh: points 5 mm apart, and a suction grasp from above. `symmetry` as a model file
/// names it; with "axis_z" the grasp's turn about its axis is free. `what` describes it.
[[nodiscard]] ShippedModel make_model(const std::string& name, const std::string& what,
                                      const Mesh& mesh, std::string_view symmetry);

/// The models of every procedural part, in the order of PartKind. Deterministic; takes a second.
[[nodiscard]] std::vector<ShippedModel> make_shipped_models();

/// Writes NAME.ply and NAME.toml of each into `folder`. Throws InputError.
void write_models(const std::vector<ShippedModel>& models, const std::filesystem::path& folder);

}  // namespace grapnel
