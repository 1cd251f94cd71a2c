#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/cloud.h"

namespace grapnel {

/// A model as Grapnel ships it: a cloud with outward normals, and what its .toml says.
struct ShippedModel {
  std::string name;
  CloudData cloud;
  std::string toml;
};

/// The models of every procedural part, in the order of PartKind. Deterministic; takes a second.
[[nodiscard]] std::vector<ShippedModel> make_shipped_models();

/// Writes NAME.ply and NAME.toml of each into `folder`. Throws InputError.
void write_models(const std::vector<ShippedModel>& models, const std::filesystem::path& folder);

}  // namespace grapnel
