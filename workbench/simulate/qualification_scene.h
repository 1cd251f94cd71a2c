#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "base/rng.h"
#include "drivers/synthetic/scene.h"
#include "workbench/simulate/part_instance.h"

namespace grapnel {

/// What a scene of a qualification set shows.
enum class SceneKind : std::uint8_t {
  Alone,       ///< the taught instance on the belt
  Cluttered,   ///< the same, other things beside it
  HalfHidden,  ///< a fifth to two thirds of it hidden behind something held above
  Touching,    ///< something else pushed against one of its sides
  Empty,       ///< nothing
  OtherKind,   ///< a part of another class
  OtherSize,   ///< another instance of the class: sizes differ
  Larger,      ///< the taught instance, 10 % larger
  Mirrored,    ///< its mirror image
  Arm,         ///< an arm over the empty belt
};
inline constexpr std::string_view kSceneKindNames[] = {
    "alone",      "cluttered",  "half_hidden", "touching", "empty",
    "other_kind", "other_size", "larger",      "mirrored", "arm"};

/// One scene of one frame. Where `has_part`, its first part is the taught instance.
struct QualificationScene {
  Scene scene;
  bool has_part = false;
  /// The surface that tells the instance's near symmetries apart points to the camera: a sack's
  /// wrinkles, the block of the nearly symmetric part; always true for the others.
  bool telling_side_up = true;
};

/// Draws sensor height and tilt, places, turns and resting poses. Some draws are unusable (a part
/// out of the image): usable() tells.
[[nodiscard]] QualificationScene draw_scene(const PartInstance& instance, SceneKind kind, Rng rng);

/// What is asked of a drawn scene after rendering: the share of the part's outline in the image
/// that is visible, 0…1, and whether all of it lies inside.
[[nodiscard]] bool usable(SceneKind kind, double visible_ratio, bool inside) noexcept;

}  // namespace grapnel
