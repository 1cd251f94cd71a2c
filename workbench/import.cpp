#include <algorithm>
#include <iostream>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "base/cloud_file.h"
#include "base/file.h"
#include "base/input_error.h"
#include "drivers/replay/image_file.h"
#include "drivers/replay/recording_writer.h"
#include "workbench/commands.h"
#include "workbench/import/cloud_grid.h"
#include "workbench/import/fakenect.h"
#include "workbench/import/known_cameras.h"
#include "workbench/import/oni.h"
#include "workbench/import/source.h"
#include "workbench/import/tiff.h"
#include "workbench/options.h"
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

/// The camera to write: the one given, the source's own, or a nominal one.
CameraFile choose_camera(Source& source, const std::optional<std::string>& given) {
  if (given) {
    source.camera_origin = *given;
    return read_camera_file(*given);
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

void write_recording(Source& source, const CameraFile& camera, bool with_color,
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

void report(const Source& source, const CameraFile& camera, const RecordingWriter& writer,
            bool json) {
  if (json) {
    const nlohmann::json answer = {{"layout", source.layout},
                                   {"recording", writer.folder().string()},
                                   {"frames", writer.depth_images()},
                                   {"colors", writer.color_images()},
                                   {"poses", source.poses.size()},
                                   {"left_out", source.left_out},
                                   {"intrinsics_from", source.camera_origin},
                                   {"fx", camera.fx},
                                   {"fy", camera.fy},
                                   {"cx", camera.cx},
                                   {"cy", camera.cy},
                                   {"metres_per_unit", camera.metres_per_unit}};
    std::cout << answer.dump() << "\n";
    return;
  }
  std::cout << writer.folder().string() << ": " << source.layout << ", " << writer.depth_images()
            << " frames, " << writer.color_images() << " colour images, " << source.poses.size()
            << " poses; " << source.left_out << " left out; intrinsics from "
            << source.camera_origin << "\n";
}

void report_oni(const OniImport& done, const std::string& folder, bool json) {
  if (json) {
    const nlohmann::json answer = {{"layout", "OpenNI"},
                                   {"recording", folder},
                                   {"frames", done.frames},
                                   {"colors", done.colors},
                                   {"poses", 0},
                                   {"left_out", done.left_out},
                                   {"intrinsics_from", done.camera_origin},
                                   {"fx", done.camera.fx},
                                   {"fy", done.camera.fy},
                                   {"cx", done.camera.cx},
                                   {"cy", done.camera.cy},
                                   {"metres_per_unit", done.camera.metres_per_unit}};
    std::cout << answer.dump() << "\n";
    return;
  }
  std::cout << folder << ": OpenNI, " << done.frames << " frames, " << done.colors
            << " colour images; " << done.left_out << " left out; intrinsics from "
            << done.camera_origin << "\n";
}

}  // namespace

int run_import(std::span<const std::string> args) {
  std::string path;
  std::string folder;
  std::optional<std::string> camera_file;
  double rate_hz = 30.0;
  SourceOptions source_options;
  bool without_color = false;
  bool unregistered_color = false;
  bool json = false;
  Options options("import", "Brings a foreign recording into Grapnel's own layout.");
  options.positional("SOURCE", path, "folder of the recording, an .oni file, or an organised PCD");
  options.required("-o,--output", folder, "folder of the new recording; must not hold one yet");
  options.value("--camera", camera_file, "camera.toml to use instead of the source's intrinsics");
  options.number("--rate", rate_hz, 0.001, 10000.0,
                 "frames a second where the source has no times");
  options.flag("--without-color", without_color, "depth only");
  options.flag("--unregistered-color", unregistered_color,
               "take colour that is not that of the depth's pixels (fakenect), as it is");
  options.flag("--skip-damaged", source_options.skip_damaged,
               "leave damaged images of a fakenect folder out instead of refusing it");
  options.flag("--json", json, "print one JSON object");
  options.footer(
      "Known layouts: TUM RGB-D (depth.txt), fakenect (INDEX.txt), 7-Scenes (frame-N.depth.png), "
      "depth_N.png with\n"
      "Intrinsic.txt, folders depth/ and rgb/ of numbered PNG, TIFF pairs, organised PCD; OpenNI's "
      ".oni, whose\n"
      "colour is taken to be registered to the depth, since the file does not say.");
  if (!options.parse(args)) return 0;
  if (is_oni(path)) {
    const OniImport done = import_oni(path, folder, camera_file, !without_color);
    report_oni(done, folder, json);
    return 0;
  }
  source_options.interval_us = static_cast<std::int64_t>(1e6 / rate_hz);
  Source source = find_source(path, source_options);
  if (source.unregistered_color && !unregistered_color) source.colors.clear();
  const CameraFile camera = choose_camera(source, camera_file);
  RecordingWriter writer(folder, camera);
  write_recording(source, camera, !without_color, writer);
  report(source, camera, writer, json);
  return 0;
}

}  // namespace grapnel
