#pragma once

#include <string>
#include <variant>
#include <vector>

#include "base/cloud.h"
#include "base/depth_frame.h"
#include "drivers/replay/frame_file.h"

namespace grapnel {

/// What stands beside an input's name.
struct InputOptions {
  std::string camera;  ///< camera.toml of a bare PNG or a foreign recording's frame; "" = none
  std::string color;   ///< colour image of a bare PNG; "" = none
};

/// A decoded input: a camera's frame or a cloud.
struct Input {
  std::string name;
  std::variant<FrameFile, CloudData> data;

  [[nodiscard]] bool is_frame() const noexcept { return data.index() == 0; }
  /// Precondition: is_frame(). Views this object's pixels.
  [[nodiscard]] DepthFrame frame() const { return std::get<0>(data).frame(); }
  /// Precondition: not is_frame().
  [[nodiscard]] const CloudData& cloud() const { return std::get<1>(data); }
};

/// Reads a cloud (.pcd, .ply), a 16-bit PNG with its camera.toml, or RECORDING#N: a recording in
/// Grapnel's layout, an .oni file or a fakenect folder. Throws InputError.
[[nodiscard]] Input load_input(const std::string& name, const InputOptions& options);

/// True when `name` ends in .pcd or .ply.
[[nodiscard]] bool is_cloud_name(const std::string& name);

/// The points of an input that have a reading, metres.
[[nodiscard]] std::vector<Vec3f> points_of(const Input& input);

/// An input as a cloud; a frame becomes an organised one with NaN where it has no reading.
[[nodiscard]] CloudData cloud_of(const Input& input);

/// The point of pixel (u, v), NaN without reading.
[[nodiscard]] Vec3f point_of_pixel(const DepthFrame& frame, int u, int v) noexcept;

}  // namespace grapnel
