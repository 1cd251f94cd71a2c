#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/field.h"
#include "drivers/synthetic/scene.h"

namespace grapnel {

/// Keys that [[part]] and [[random]] share.
struct PartKeys {
  std::string name;
  std::string model;
  PartKind kind = PartKind::Box;
  std::vector<double> size_m;  ///< 3; empty: default_size_m()
  double albedo = 0.6;
  int station = 0;
  std::uint64_t seed = kModelSackSeed;
  std::string mesh;

  [[nodiscard]] static FieldTable fields() noexcept;
};

/// Where a [[part]] lies.
struct PlaceKeys {
  double x_m = 0.0;
  double y_m = 0.0;
  double yaw_rad = 0.0;
  Resting resting = Resting::Upright;
  std::vector<double> world_from_model;  ///< 16, row-major; takes the place of the others

  [[nodiscard]] static FieldTable fields() noexcept;
};

/// What a [[random]] makes: `count` things at each of `stations` stations from its `station` on.
struct RandomKeys {
  int stations = 1;
  int count = 1;
  std::vector<double> size_high_m;  ///< 3; empty: as size_m
  std::vector<double> region_m = {-0.15, 0.15, -0.10, 0.10};
  bool event = false;

  [[nodiscard]] static FieldTable fields() noexcept;
};

/// One kind of table of a scene's file.
struct SceneSection {
  std::string_view name;  ///< as written: "[camera]", "[[part]]"
  FieldTable fields;
  const void* defaults;  ///< a struct of the fields' kind
};

/// Every table of SCENE.toml; a name may stand in several rows.
[[nodiscard]] std::span<const SceneSection> scene_sections();

[[nodiscard]] FieldTable scene_fields() noexcept;
[[nodiscard]] FieldTable scene_camera_fields() noexcept;
[[nodiscard]] FieldTable belt_fields() noexcept;
[[nodiscard]] FieldTable scene_event_fields() noexcept;
[[nodiscard]] FieldTable scene_fault_fields() noexcept;

}  // namespace grapnel
