#pragma once

#include <cstddef>
#include <cstdint>

namespace grapnel {
class Camera;
class Clock;
}  // namespace grapnel

/// Raised with every change to GrapnelCameraPlugin, grapnel::Camera or what they hand over.
inline constexpr std::uint32_t kGrapnelCameraAbi = 3;

extern "C" {

/// What a camera plug-in (a shared object) exports.
struct GrapnelCameraPlugin {
  std::uint32_t
      abi_version;   ///< kGrapnelCameraAbi the plug-in was built with; any other is refused
  const char* name;  ///< the driver's name, as in `camera = "…"`
  /// Makes a camera from the [camera] table, given as TOML text. nullptr on failure, with one line
  /// in `problem`. `clock` outlives the camera.
  grapnel::Camera* (*create)(const char* options_toml, const grapnel::Clock* clock, char* problem,
                             std::size_t problem_bytes);
  void (*destroy)(grapnel::Camera* camera);
  /// Writes one line a device that is present ("serial model") and returns their number.
  int (*list)(char* lines, std::size_t bytes);
};

/// The one symbol a plug-in exports: `grapnel_camera_plugin`.
using GrapnelCameraPluginEntry = const GrapnelCameraPlugin* (*)();
}

inline constexpr const char* kGrapnelCameraPluginSymbol = "grapnel_camera_plugin";
