#include <array>
#include <iostream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "base/file.h"
#include "base/formats/text_scanner.h"
#include "base/input_error.h"
#include "drivers/replay/image_file.h"
#include "workbench/calibrate/chessboard.h"
#include "workbench/calibrate/flat_wall.h"
#include "workbench/calibrate/zhang.h"
#include "workbench/commands.h"
#include "workbench/options.h"

namespace grapnel {
namespace {

constexpr const char* kKinds = "depth or intrinsics";

struct DepthRun {
  std::vector<std::string> walls;
  std::string output;
  std::int64_t frames = 60;
  std::int64_t columns = 16;
  std::int64_t rows = 12;
  bool json = false;
};

void report(const DepthRun& run, const CameraFile& camera, const std::vector<WallReport>& walls) {
  if (run.json) {
    nlohmann::ordered_json list = nlohmann::ordered_json::array();
    for (const WallReport& wall : walls) {
      list.push_back({{"recording", wall.name},
                      {"axis_m", wall.axis_m},
                      {"corrected_axis_m", wall.corrected_axis_m},
                      {"plane_share", wall.plane_share},
                      {"rms_before_m", wall.rms_before_m},
                      {"rms_after_m", wall.rms_after_m}});
    }
    const nlohmann::ordered_json answer = {{"camera", run.output},
                                           {"serial", camera.serial},
                                           {"disparity_law", camera.disparity_law},
                                           {"walls", list}};
    std::cout << answer.dump() << "\n";
    return;
  }
  for (const WallReport& wall : walls) {
    std::cout << wall.name << ": " << wall.axis_m << " m, corrected " << wall.corrected_axis_m
              << " m; off its plane by " << 1e3 * wall.rms_before_m << " mm rms, corrected "
              << 1e3 * wall.rms_after_m << " mm\n";
  }
  std::cout << run.output << " is for "
            << (camera.serial.empty() ? "any unit, since the recordings name no serial"
                                      : "serial \"" + camera.serial + "\"")
            << ": name it in [camera] calibration\n";
}

int run_depth(std::span<const std::string> args) {
  DepthRun run;
  Options options("calibrate depth",
                  "Corrects a sensor's depth by recordings of a flat wall or an empty belt.");
  options.positionals(
      "RECORDING", run.walls, 1,
      "RECORDING or RECORDING=METRES, its distance measured along the optical axis");
  options.required("-o,--output", run.output, "camera.toml to write");
  options.integer("--frames", run.frames, 1, 10000, "of each recording to take the mean of");
  options.integer("--columns", run.columns, 2, 64, "of the grid of multipliers");
  options.integer("--rows", run.rows, 2, 64, "of the grid of multipliers");
  options.flag("--json", run.json, "print one JSON object");
  options.footer(
      "The wall fills the image, at two or more distances over the range of work; tilt does not\n"
      "matter. Distances set the disparity law: without any, walls are only made flat.");
  if (!options.parse(args)) return 0;
  std::vector<WallView> walls;
  CameraFile camera;
  for (std::size_t i = 0; i < run.walls.size(); ++i) {
    CameraFile own;
    walls.push_back(read_wall(run.walls[i], static_cast<std::size_t>(run.frames), own));
    if (i == 0) camera = own;
    const bool same = own.width == camera.width && own.height == camera.height &&
                      own.fx == camera.fx && own.serial == camera.serial;
    if (!same) {
      throw InputError(run.walls[i] + ": is of another camera than " + run.walls.front());
    }
  }
  const std::vector<WallReport> reports =
      calibrate_depth(walls, {static_cast<int>(run.columns), static_cast<int>(run.rows)}, camera);
  write_file(run.output, camera_file_text(camera), WriteSync::Durable);
  report(run, camera, reports);
  return 0;
}

struct IntrinsicsRun {
  std::vector<std::string> images;
  std::string output;
  std::string board = "9x6";
  double square_m = 0.025;
  std::string serial;
  std::string shift;
  bool json = false;
};

/// "9x6" as inner corners across and down.
std::array<int, 2> parse_board(const std::string& text) {
  std::array<int, 2> size{};
  const std::size_t cross = text.find('x');
  for (std::size_t i = 0; i < 2 && cross != std::string::npos; ++i) {
    std::uint64_t count = 0;
    const std::string part = i == 0 ? text.substr(0, cross) : text.substr(cross + 1);
    if (parse_count(part, count) && count >= 3 && count <= 40) size[i] = static_cast<int>(count);
  }
  if (size[0] == 0 || size[1] == 0) {
    throw InputError("--board: \"" + text +
                     "\" is not allowed; inner corners as 9x6 are, 3 to 40 each way");
  }
  return size;
}

void report(const IntrinsicsRun& run, const CameraFit& fit, const std::vector<std::string>& used) {
  const Intrinsics& k = fit.intrinsics;
  if (run.json) {
    const nlohmann::ordered_json answer = {{"camera", run.output},
                                           {"images", used},
                                           {"given", run.images.size()},
                                           {"fx", k.fx},
                                           {"fy", k.fy},
                                           {"cx", k.cx},
                                           {"cy", k.cy},
                                           {"sigma_px", fit.sigma_px},
                                           {"distortion", fit.distortion},
                                           {"rms_px", fit.rms_px}};
    std::cout << answer.dump() << "\n";
    return;
  }
  std::cout << used.size() << " of " << run.images.size() << " images show the whole board; rms "
            << fit.rms_px << " px\nfx " << k.fx << " ± " << fit.sigma_px[0] << ", fy " << k.fy
            << " ± " << fit.sigma_px[1] << ", cx " << k.cx << " ± " << fit.sigma_px[2] << ", cy "
            << k.cy << " ± " << fit.sigma_px[3] << "\n"
            << run.output << " is written\n";
}

int run_intrinsics(std::span<const std::string> args) {
  IntrinsicsRun run;
  Options options("calibrate intrinsics",
                  "Measures a camera's focal lengths, centre and lens distortion by a chessboard.");
  options.positionals("IMAGE", run.images, 3, "PNG or JPEG of the board, ten or more, tilted");
  options.required("-o,--output", run.output, "camera.toml to write");
  options.value("--board", run.board, "inner corners across and down");
  options.number("--square", run.square_m, 1e-4, 1.0, "side of a square, m");
  options.value("--serial", run.serial, "of the sensor, for the file");
  options.value("--ir-shift", run.shift,
                "U,V: the images are infrared ones, whose pixel (u+U, v+V) is depth pixel (u, v)");
  options.flag("--json", run.json, "print one JSON object");
  options.footer(
      "Images of the infrared camera hold for the depth image, up to a shift of a few pixels; "
      "cover\n"
      "the projector. Images of the colour camera hold for depth that is registered to it.\n"
      "Exit code: 0 written, 2 fewer than three images show the whole board.");
  if (!options.parse(args)) return 0;
  const std::array<int, 2> board = parse_board(run.board);
  CameraFile camera;
  if (!run.shift.empty()) camera.ir_shift_px = parse_numbers(run.shift, 2, "--ir-shift");
  std::vector<BoardView> views;
  std::vector<std::string> used;
  for (const std::string& file : run.images) {
    const ColorImage image = read_color_image(file);
    if (camera.width == 0) {
      camera.width = image.width;
      camera.height = image.height;
    }
    if (image.width != camera.width || image.height != camera.height) {
      throw InputError(file + ": " + std::to_string(image.width) + " by " +
                       std::to_string(image.height) + " pixels; the first image has " +
                       std::to_string(camera.width) + " by " + std::to_string(camera.height));
    }
    const auto corners = find_chessboard(gray_of(image.view()), board[0], board[1]);
    if (!corners) continue;
    views.push_back({*corners});
    used.push_back(file);
  }
  const CameraFit fit =
      fit_camera(views, board[0], board[1], run.square_m, camera.width, camera.height);
  camera.fx = fit.intrinsics.fx;
  camera.fy = fit.intrinsics.fy;
  camera.cx = fit.intrinsics.cx;
  camera.cy = fit.intrinsics.cy;
  camera.distortion = fit.distortion;
  camera.serial = run.serial;
  write_file(run.output, camera_file_text(camera), WriteSync::Durable);
  report(run, fit, used);
  return 0;
}

}  // namespace

int run_calibrate(std::span<const std::string> args) {
  const std::string kind = args.empty() ? "" : args[0];
  if (kind == "depth") return run_depth(args.subspan(1));
  if (kind == "intrinsics") return run_intrinsics(args.subspan(1));
  if (kind == "--help" || kind == "-h") {
    std::cout << "grapnel calibrate KIND …; KIND is " << kKinds
              << "; grapnel calibrate KIND --help says more\n";
    return 0;
  }
  if (kind.empty()) throw InputError(std::string("KIND is missing; ") + kKinds + " is needed");
  throw InputError("\"" + kind + "\" can't be calibrated; " + kKinds + " can");
}

}  // namespace grapnel
