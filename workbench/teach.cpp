#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <optional>
#include <string>
#include <vector>

#include "base/cloud_file.h"
#include "base/input_error.h"
#include "drivers/replay/image_file.h"
#include "drivers/replay/recording.h"
#include "pipeline/model.h"
#include "workbench/commands.h"
#include "workbench/options.h"
#include "workbench/progress.h"
#include "workbench/teach/fused_model.h"

namespace grapnel {
namespace {

namespace fs = std::filesystem;

struct TeachOptions {
  std::vector<std::string> recordings;
  std::string output;
  std::string frames;
  std::string roi;
  std::string symmetry = "none";
  std::vector<std::string> masks;
  double voxel_m = 0.0;
  std::int64_t min_views = 1;
  std::int64_t max_points = 15000;
  bool identity = false;
  bool center = false;
};

std::optional<TeachOptions> parse(std::span<const std::string> args) {
  TeachOptions wanted;
  Options options("teach",
                  "Fuses frames of known pose into a model: points with normals, in metres.");
  options.positionals("RECORDING", wanted.recordings, 1,
                      "recordings with groundtruth.txt (world_from_camera), or of a still part");
  options.required("-o,--output", wanted.output, "MODEL.ply or .pcd; MODEL.toml is written beside");
  options.value("--frames", wanted.frames, "frames of each recording, as 0,2,4 or 0-16:2 (all)");
  options.value("--roi", wanted.roi, "x0,y0,z0,x1,y1,z1 in metres: keep what lies in this box");
  options.list("--mask", wanted.masks,
               "images, black = leave out: one for all frames or one a frame");
  options.number("--voxel", wanted.voxel_m, 0.0, 1.0,
                 "metres; 0 = the frames' own sampling, wider where --max-points asks for it");
  options.integer("--min-views", wanted.min_views, 1, 1000,
                  "frames that must have seen a point; more drop what few frames cover");
  options.integer("--max-points", wanted.max_points, 100, 1000000, "of the model");
  options.value("--symmetry", wanted.symmetry, "declared in MODEL.toml: none, z180, box, …");
  options.flag("--identity", wanted.identity, "the camera stood still: ignore groundtruth.txt");
  options.flag("--center", wanted.center, "move the origin to the centre of the bounding box");
  if (!options.parse(args)) return std::nullopt;
  static_cast<void>(symmetry_from_name(wanted.symmetry));
  if (!wanted.output.ends_with(".ply") && !wanted.output.ends_with(".pcd")) {
    throw InputError("-o " + wanted.output + ": a model is a .ply or .pcd file");
  }
  return wanted;
}

/// The pose of the frame at `time_us`, by the nearest row of the truth.
Pose pose_at(const std::vector<TimedPose>& truth, std::int64_t time_us, const std::string& frame) {
  constexpr std::int64_t kMaxGap_us = 20'000;
  std::vector<std::int64_t> times_us;
  for (const TimedPose& row : truth) times_us.push_back(row.time_us);
  const std::size_t row = nearest_time(times_us, time_us, kMaxGap_us);
  if (row == truth.size()) {
    throw InputError(frame + ": groundtruth.txt has no pose within 20 ms of this frame");
  }
  return truth[row].pose;
}

ColorImage load_mask(const TeachOptions& wanted, std::size_t view, const CameraFile& camera) {
  if (wanted.masks.empty()) return {};
  if (wanted.masks.size() != 1 && view >= wanted.masks.size()) {
    throw InputError("--mask: " + std::to_string(wanted.masks.size()) +
                     " images for more frames; one, or one a frame are allowed");
  }
  const std::string& file = wanted.masks[wanted.masks.size() == 1 ? 0 : view];
  ColorImage mask = read_color_image(file);
  if (mask.width != camera.width || mask.height != camera.height) {
    throw InputError(file + ": " + std::to_string(mask.width) + "×" + std::to_string(mask.height) +
                     " pixels; the frames have " + std::to_string(camera.width) + "×" +
                     std::to_string(camera.height));
  }
  return mask;
}

void read_views(const TeachOptions& wanted, const std::string& name,
                std::vector<TaughtView>& views) {
  const Recording recording = Recording::open(name);
  const std::vector<TimedPose> truth =
      wanted.identity ? std::vector<TimedPose>{} : recording.ground_truth();
  std::vector<std::size_t> frames;
  if (wanted.frames.empty()) {
    for (std::size_t i = 0; i < recording.frame_count(); ++i) frames.push_back(i);
  } else {
    frames = parse_indices(wanted.frames, "--frames");
  }
  const CameraFile& camera = recording.camera();
  const std::size_t pixels =
      static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
  std::vector<std::uint16_t> depth(pixels);
  std::vector<Rgb8> color(pixels);
  Progress progress("teach " + name, frames.size());
  for (const std::size_t i : frames) {
    const std::string frame_name = name + "#" + std::to_string(i);
    if (i >= recording.frame_count()) {
      throw InputError(frame_name + ": the recording has frames 0 to " +
                       std::to_string(recording.frame_count() - 1));
    }
    const bool colored = recording.read_frame(i, depth, color);
    DepthFrame frame;
    frame.depth = {depth.data(), camera.width, camera.height};
    if (colored) frame.color = {color.data(), camera.width, camera.height};
    frame.metres_per_unit = camera.metres_per_unit;
    frame.intrinsics = camera.intrinsics();
    const ColorImage mask = load_mask(wanted, views.size(), camera);
    TaughtView view;
    view.samples = frame_samples(frame, mask.view());
    if (!truth.empty()) view.model_from_camera = pose_at(truth, recording.time_us(i), frame_name);
    views.push_back(std::move(view));
    progress.step();
  }
}

void move_to_center(CloudData& cloud) {
  const auto shift = [](std::vector<float>& values) {
    const auto [low, high] = std::minmax_element(values.begin(), values.end());
    const float middle = 0.5F * (*low + *high);
    for (float& value : values) value -= middle;
  };
  for (std::vector<float>* axis : {&cloud.x, &cloud.y, &cloud.z}) shift(*axis);
}

void write_model_toml(const TeachOptions& wanted, std::size_t views, double voxel_m) {
  const fs::path file = fs::path(wanted.output).replace_extension(".toml");
  std::ofstream stream(file);
  stream << "# Taught from " << views << " frames, averaged in voxels of " << voxel_m * 1e3
         << " mm.\n"
         << "unit_m = 1.0\n"
         << "symmetry = \"" << wanted.symmetry << "\"\n\n"
         << "[[grasp]]\nid = 1\nname = \"origin\"\n"
         << "model_from_grasp = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]\n";
  stream.flush();
  if (!stream) throw InputError(file.string() + ": can't be written");
}

}  // namespace

int run_teach(std::span<const std::string> args) {
  const std::optional<TeachOptions> wanted = parse(args);
  if (!wanted) return 0;
  std::vector<TaughtView> views;
  for (const std::string& recording : wanted->recordings) read_views(*wanted, recording, views);

  const double focal_px = Recording::open(wanted->recordings.front()).camera().fx;
  FusedModelOptions options;
  options.voxel_m = wanted->voxel_m;
  options.min_views = static_cast<std::size_t>(wanted->min_views);
  options.max_points = static_cast<std::size_t>(wanted->max_points);
  options.roi = parse_box(wanted->roi, "--roi");
  FusedModel model = fuse_views(views, pixel_sampling_m(views, focal_px), options);
  if (wanted->center) move_to_center(model.cloud);
  write_cloud(wanted->output, model.cloud);
  write_model_toml(*wanted, views.size(), model.voxel_m);
  std::cout << wanted->output << ": " << model.cloud.size() << " points from " << views.size()
            << " frames, voxel " << model.voxel_m * 1e3 << " mm\n";
  return 0;
}

}  // namespace grapnel
