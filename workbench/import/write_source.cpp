#include "workbench/import/write_source.h"

#include <algorithm>

#include "base/cloud_file.h"
#include "base/file.h"
#include "base/input_error.h"
#include "drivers/replay/image_file.h"
#include "workbench/import/cloud_grid.h"
#include "workbench/import/fakenect.h"
#include "workbench/import/known_cameras.h"
#include "workbench/import/tiff.h"
#include "workbench/progress.h"

namespace grapnel {
namespace {

bool is_tiff(const std::filesystem::path& file) {
  return file.extension() == ".tiff" || file.extension() == ".tif";
}

DepthImage read_any_depth(const std::filesystem::path& file, double metres_per_unit) {
  if (is_tiff(file)) return read_depth_tiff(file);
  if (file.extension() == ".pgm") return read_fakenect_depth(file);
  if (file.extension() == ".pcd") return depth_of(read_cloud(file), metres_per_unit);
  return read_depth_png(file);
}

void check_size(const std::filesystem::path& file, const CameraFile& camera, int width,
                int height) {
  if (width == camera.width && height == camera.height) return;
  throw InputError(file.string() + ": " + std::to_string(width) + " by " + std::to_string(height) +
                   " pixels; the camera has " + std::to_string(camera.width) + " by " +
                   std::to_string(camera.height));
}

/// Decodes every image once, so that what is imported is known to be readable.
void write_depth(const SourceFrame& frame, const CameraFile& camera, RecordingWriter& writer) {
  const DepthImage image = read_any_depth(frame.depth, camera.metres_per_unit);
  check_size(frame.depth, camera, image.width, image.height);
  if (frame.depth.extension() == ".png") {
    writer.add_depth_file(frame.time_us, frame.depth);
  } else {
    writer.add_depth(frame.time_us, image.view());
  }
}

void write_color(const SourceFrame& frame, const CameraFile& camera, RecordingWriter& writer) {
  const std::filesystem::path& file = frame.color.empty() ? frame.depth : frame.color;
  ColorImage image;
  const bool cloud = file.extension() == ".pcd";
  if (cloud) {
    image = colors_of(read_cloud(file));
  } else if (file.extension() == ".ppm") {
    image = read_fakenect_color(file);
  } else {
    image = is_tiff(file) ? read_color_tiff(file) : read_color_image(file);
  }
  if (image.pixels.empty()) return;
  check_size(file, camera, image.width, image.height);
  if (cloud || is_tiff(file) || file.extension() == ".ppm") {
    writer.add_color(frame.time_us, image.view());
  } else {
    writer.add_color_file(frame.time_us, file);
  }
}

/// Index times must differ; a source's may not.
void spread_times(std::vector<SourceFrame>& frames) {
  for (std::size_t i = 1; i < frames.size(); ++i) {
    frames[i].time_us = std::max(frames[i].time_us, frames[i - 1].time_us + 1);
  }
}

}  // namespace

CameraFile choose_camera(Source& source, const std::optional<std::string>& given) {
  if (given) {
    source.camera_origin = *given;
    CameraFile camera = read_camera_file(*given);
    if (source.fixed_unit) camera.metres_per_unit = source.camera->metres_per_unit;
    return camera;
  }
  const double unit_m = source.camera ? source.camera->metres_per_unit : 0.0;
  const DepthImage first = read_any_depth(source.frames.front().depth, unit_m);
  if (!source.camera) {
    KnownCamera nominal = nominal_camera(first.width, first.height);
    source.camera_origin = nominal.origin;
    return nominal.camera;
  }
  CameraFile camera = *source.camera;
  if (camera.width == 0) camera.width = first.width;
  if (camera.height == 0) camera.height = first.height;
  return camera;
}

void write_source(Source& source, const CameraFile& camera, bool with_color,
                  RecordingWriter& writer) {
  spread_times(source.frames);
  spread_times(source.colors);
  Progress progress("import", source.frames.size());
  for (const SourceFrame& frame : source.frames) {
    write_depth(frame, camera, writer);
    const bool own_color = !frame.color.empty() || frame.depth.extension() == ".pcd";
    if (with_color && own_color) write_color(frame, camera, writer);
    progress.step();
  }
  for (const SourceFrame& color : source.colors) {
    if (with_color) write_color(color, camera, writer);
  }
  for (const TimedPose& timed : source.poses) writer.add_pose(timed);
  for (const std::filesystem::path& file : source.side_files) {
    write_file(writer.folder() / file.filename(), read_file(file, kMaxIndexBytes));
  }
}

}  // namespace grapnel
