#include <iostream>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "drivers/replay/recording_writer.h"
#include "workbench/commands.h"
#include "workbench/import/oni.h"
#include "workbench/import/source.h"
#include "workbench/import/write_source.h"
#include "workbench/options.h"

namespace grapnel {
namespace {

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
  if (source.unregistered_color && writer.color_images() == 0) {
    std::cout << "its colour is not that of the depth's pixels and is left out; "
                 "--unregistered-color takes it as it is\n";
  }
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
  write_source(source, camera, !without_color, writer);
  report(source, camera, writer, json);
  return 0;
}

}  // namespace grapnel
