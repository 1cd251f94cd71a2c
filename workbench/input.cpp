#include "workbench/input.h"

#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "base/cloud_file.h"
#include "base/input_error.h"
#include "drivers/replay/recording.h"
#include "workbench/import/fakenect.h"
#include "workbench/import/oni.h"

namespace grapnel {
namespace {

std::optional<std::string> given(const std::string& text) {
  return text.empty() ? std::nullopt : std::optional<std::string>(text);
}

/// Frame N of an .oni file or a fakenect folder; nothing for a recording of Grapnel's own.
std::optional<FrameFile> read_foreign(const std::string& name, const InputOptions& options) {
  const std::optional<FrameName> frame = parse_frame_name(name);
  if (!frame) return std::nullopt;
  const bool oni = is_oni(frame->folder);
  if (!oni && !is_fakenect(frame->folder)) return std::nullopt;
  FrameFile file = oni ? read_oni_frame(frame->folder, frame->frame)
                       : read_fakenect_frame(frame->folder, frame->frame);
  if (options.camera.empty()) return file;
  const CameraFile sensor = std::exchange(file.camera, read_camera_file(options.camera));
  if (file.camera.width != sensor.width || file.camera.height != sensor.height) {
    throw InputError(options.camera + ": " + std::to_string(file.camera.width) + " by " +
                     std::to_string(file.camera.height) + " pixels; " + name + " has " +
                     std::to_string(sensor.width) + " by " + std::to_string(sensor.height));
  }
  // The counts are the recording's, whatever the file says of other ones.
  file.camera.metres_per_unit = sensor.metres_per_unit;
  correct_frame(file);
  return file;
}

}  // namespace

bool is_cloud_name(const std::string& name) {
  return name.ends_with(".pcd") || name.ends_with(".ply");
}

Input load_input(const std::string& name, const InputOptions& options) {
  if (is_cloud_name(name)) return {name, read_cloud(name)};
  if (std::optional<FrameFile> foreign = read_foreign(name, options)) {
    if (!options.color.empty()) {
      throw InputError(options.color + ": a frame of a recording takes no other colour");
    }
    return {name, std::move(*foreign)};
  }
  if (name.ends_with(".png") || name.find('#') != std::string::npos) {
    return {name, read_frame_file(name, given(options.camera), given(options.color))};
  }
  throw InputError(
      name +
      ": a cloud (.pcd, .ply), a 16-bit .png or RECORDING#N is needed, a recording being "
      "Grapnel's own, an .oni file or a fakenect folder");
}

Vec3f point_of_pixel(const DepthFrame& frame, int u, int v) noexcept {
  const std::uint16_t count = frame.depth.at(u, v);
  if (count == 0) return Vec3f::Constant(std::numeric_limits<float>::quiet_NaN());
  const double z = count * frame.metres_per_unit;
  const Intrinsics& k = frame.intrinsics;
  return {static_cast<float>((u - k.cx) / k.fx * z), static_cast<float>((v - k.cy) / k.fy * z),
          static_cast<float>(z)};
}

CloudData cloud_of(const Input& input) {
  if (!input.is_frame()) return input.cloud();
  const DepthFrame frame = input.frame();
  CloudData cloud;
  cloud.width = frame.depth.width;
  cloud.height = frame.depth.height;
  for (int v = 0; v < frame.depth.height; ++v) {
    for (int u = 0; u < frame.depth.width; ++u) {
      const Vec3f point = point_of_pixel(frame, u, v);
      cloud.x.push_back(point.x());
      cloud.y.push_back(point.y());
      cloud.z.push_back(point.z());
      if (!frame.color.empty()) cloud.color.push_back(frame.color.at(u, v));
    }
  }
  return cloud;
}

std::vector<Vec3f> points_of(const Input& input) {
  std::vector<Vec3f> points;
  const auto push = [&](const Vec3f& point) {
    if (point.allFinite()) points.push_back(point);
  };
  if (input.is_frame()) {
    const DepthFrame frame = input.frame();
    for (int v = 0; v < frame.depth.height; ++v) {
      for (int u = 0; u < frame.depth.width; ++u) push(point_of_pixel(frame, u, v));
    }
  } else {
    const CloudData& cloud = input.cloud();
    for (std::size_t i = 0; i < cloud.size(); ++i) push({cloud.x[i], cloud.y[i], cloud.z[i]});
  }
  return points;
}

}  // namespace grapnel
