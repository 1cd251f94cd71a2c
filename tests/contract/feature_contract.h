#pragma once

#include <cstdint>
#include <memory>
#include <ostream>
#include <string>
#include <vector>

#include "base/config.h"
#include "pipeline/registry.h"
#include "tests/pipeline/support/surfaces.h"

namespace grapnel::test {

/// One way to set a method of the registry: its name and keys in TOML.
struct MethodCase {
  std::string name;
  std::string keys;

  friend void PrintTo(const MethodCase& method, std::ostream* out) {
    *out << method.name << ' ' << method.keys;
  }
};

/// A name that gtest accepts.
[[nodiscard]] std::string case_name(const MethodCase& method);

/// The method's stage as a preset would make it.
template <class StageKind>
[[nodiscard]] std::unique_ptr<StageKind> make_stage(std::span<const Method<StageKind>> methods,
                                                    const MethodCase& chosen) {
  const ConfigTable table = parse_config(chosen.keys, chosen.name);
  ConfigReader reader(table);
  std::unique_ptr<StageKind> stage = find_method(methods, chosen.name).make(reader);
  reader.finish();
  return stage;
}

/// Every method of a registry with each value of its key `choice`, one case where it has none.
template <class StageKind>
[[nodiscard]] std::vector<MethodCase> every_choice(std::span<const Method<StageKind>> methods,
                                                   std::string_view choice) {
  std::vector<MethodCase> cases;
  for (const Method<StageKind>& method : methods) {
    const std::size_t before = cases.size();
    for (const Field& field : method.fields()) {
      if (field.name != choice) continue;
      for (const std::string_view value : field.choices) {
        cases.push_back({std::string(method.name),
                         std::string(choice) + " = \"" + std::string(value) + "\"\n"});
      }
    }
    if (cases.size() == before) cases.push_back({std::string(method.name), ""});
  }
  return cases;
}

/// True where the method has this key.
template <class StageKind>
[[nodiscard]] bool has_key(std::span<const Method<StageKind>> methods, const MethodCase& chosen,
                           std::string_view key) {
  for (const Field& field : find_method(methods, chosen.name).fields()) {
    if (field.name == key) return true;
  }
  return false;
}

/// Limits for the surfaces of these tests.
[[nodiscard]] Limits contract_limits();

/// A bumpy closed surface with normals.
[[nodiscard]] OwnedSurface oriented_ball(std::size_t points);

/// Surfaces that a careless method trips over, by name.
struct OddSurface {
  std::string name;
  OwnedSurface surface;
};
[[nodiscard]] std::vector<OddSurface> odd_surfaces();

/// Every step-th point.
[[nodiscard]] std::vector<Keypoint> keypoints_of(const Surface& surface, std::size_t step);

}  // namespace grapnel::test
