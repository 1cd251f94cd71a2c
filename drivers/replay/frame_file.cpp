#include "drivers/replay/frame_file.h"

#include <algorithm>
#include <cstddef>

#include "base/file.h"
#include "base/input_error.h"
#include "drivers/replay/depth_correction.h"
#include "drivers/replay/image_file.h"
#include "drivers/replay/recording.h"
#include "drivers/replay/undistort.h"

namespace grapnel {
namespace {

std::size_t pixel_count(const CameraFile& camera) noexcept {
  return static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
}

void read_color(FrameFile& file, const std::string& color) {
  file.color.resize(pixel_count(file.camera));
  decode_color_image(read_file(color, kMaxImageFileBytes), color, file.camera.width,
                     file.camera.height, file.color);
  const std::vector<std::uint32_t> map = undistortion_map(file.camera);
  if (!map.empty()) undistort<Rgb8>(map, file.color);
}

FrameFile read_recorded(const FrameName& name) {
  const Recording recording = Recording::open(name.folder);
  if (name.frame >= recording.frame_count()) {
    throw InputError(name.folder.string() + ": there is no frame " + std::to_string(name.frame) +
                     "; 0 to " + std::to_string(recording.frame_count() - 1) + " are there");
  }
  FrameFile file;
  file.camera = recording.camera();
  file.time_us = recording.time_us(name.frame);
  file.number = name.frame;
  file.depth.resize(pixel_count(file.camera));
  if (recording.has_color(name.frame)) file.color.resize(file.depth.size());
  recording.read_frame(name.frame, file.depth, file.color);
  return file;
}

FrameFile read_bare(const std::string& name, const std::string& camera) {
  FrameFile file;
  file.camera = read_camera_file(camera);
  file.depth.resize(pixel_count(file.camera));
  decode_depth_png(read_file(name, kMaxImageFileBytes), name, file.camera.width, file.camera.height,
                   file.depth);
  correct_frame(file);
  return file;
}

}  // namespace

DepthFrame FrameFile::frame() const noexcept {
  DepthFrame frame;
  frame.depth = {depth.data(), camera.width, camera.height};
  if (!color.empty()) frame.color = {color.data(), camera.width, camera.height};
  frame.metres_per_unit = camera.metres_per_unit;
  frame.intrinsics = camera.intrinsics();
  frame.baseline_m = camera.baseline_m;
  frame.exposure_us = time_us;
  frame.device_us = time_us;
  frame.sequence = number;
  frame.recorded = true;
  frame.corrected = camera.corrects();
  return frame;
}

void correct_frame(FrameFile& file) {
  erase_invalid(file.camera, file.depth);
  const std::vector<std::uint32_t> map = undistortion_map(file.camera);
  if (!map.empty()) undistort<std::uint16_t>(map, file.depth);
  if (!map.empty() && !file.color.empty()) undistort<Rgb8>(map, file.color);
  const DepthCorrection correction(file.camera, file.camera.metres_per_unit);
  std::vector<float> scratch(correction.scratch_floats());
  correction.apply(file.depth, scratch);
}

FrameFile read_frame_file(const std::string& name, const std::optional<std::string>& camera,
                          const std::optional<std::string>& color) {
  const std::optional<FrameName> recorded = parse_frame_name(name);
  if (!recorded && !camera) {
    throw InputError(name + ": a bare depth image needs --camera camera.toml");
  }
  FrameFile file = recorded ? read_recorded(*recorded) : read_bare(name, *camera);
  if (color) read_color(file, *color);
  return file;
}

}  // namespace grapnel
