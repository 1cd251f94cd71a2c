#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/cloud_file.h"
#include "base/input_error.h"
#include "drivers/replay/image_file.h"
#include "pipeline/model.h"
#include "workbench/commands.h"
#include "workbench/options.h"
#include "workbench/teach/given_poses.h"
#include "workbench/teach/model_quality.h"
#include "workbench/views/common_frame_json.h"
#include "workbench/views/view_model.h"

namespace grapnel {
namespace {

namespace fs = std::filesystem;

// A side is called unseen when more than half of it shows the inside.
constexpr double kUnseen = 0.5;
constexpr int kPictureSide_px = 320;

struct TeachOptions {
  GivenPoses given;
  ViewOptions views;
  CommonFrameOptions frame;
  FusedModelOptions model;
  std::string output;
  std::string picture;
  std::string symmetry = "none";
  bool find_poses = false;
  bool center = false;
  bool json = false;
};

/// What there is to be fused.
struct Taught {
  std::vector<TaughtView> views;
  double sampling_m = 0.0;
  std::vector<View> loaded;          ///< where poses were found
  std::optional<CommonFrame> frame;  ///< the same
};

void declare_found(Options& options, TeachOptions& wanted, std::string& crop, bool& keep_focal,
                   std::int64_t& reach, std::int64_t& jobs) {
  options.flag("--find-poses", wanted.find_poses,
               "find the poses as register-many does; so it is where none are given");
  options.value("--preset", wanted.frame.preset, "of the pairs, where poses are found (pair)");
  options.value("--camera", wanted.views.input.camera, "camera.toml of bare PNGs");
  options.value("--crop", crop,
                "x0,y0,z0,x1,y1,z1 in metres, in each camera's frame, where poses are found: "
                "leaves out what does not turn with the part");
  options.integer("--reach", reach, 0, 1000000,
                  "pairs at most this far apart in the list (0 = every pair)");
  options.flag("--keep-focal", keep_focal, "take the cameras' focal lengths as they are");
  options.integer("--jobs", jobs, 1, 256, "pairs at once; the result does not depend on it");
}

std::optional<TeachOptions> parse(std::span<const std::string> args) {
  TeachOptions wanted;
  std::string roi;
  std::string crop;
  std::int64_t min_views = 1;
  std::int64_t max_points = 15000;
  std::int64_t reach = 0;
  std::int64_t jobs = 1;
  bool keep_focal = false;
  Options options("teach", "Fuses frames into a model: points with normals, in metres.");
  options.positionals("RECORDING", wanted.given.recordings, 1,
                      "recordings with groundtruth.txt (world_from_camera) or of a still part; or "
                      "recordings and views (.png, .pcd, .ply, RECORDING#N) without poses");
  options.required("-o,--output", wanted.output,
                   "MODEL.ply or .pcd; MODEL.toml and MODEL.png are written beside");
  options.value("--frames", wanted.given.frames, "of each recording, as 0,2,4 or 0-16:2 (all)");
  options.value("--roi", roi, "x0,y0,z0,x1,y1,z1 in metres, in the model's frame: keep this box");
  options.list("--mask", wanted.given.masks,
               "images, black = leave out: one for all frames or one a frame");
  options.number("--voxel", wanted.model.voxel_m, 0.0, 1.0,
                 "metres; 0 = the frames' own sampling, wider where --max-points asks for it");
  options.integer("--min-views", min_views, 1, 1000,
                  "frames that must have seen a point; more drop what few frames cover");
  options.integer("--max-points", max_points, 100, 1000000, "of the model");
  options.value("--symmetry", wanted.symmetry, "declared in MODEL.toml: none, z180, box, …");
  options.flag("--identity", wanted.given.still, "the camera stood still: ignore groundtruth.txt");
  options.flag("--center", wanted.center, "move the origin to the centre of the bounding box");
  declare_found(options, wanted, crop, keep_focal, reach, jobs);
  options.value("--picture", wanted.picture, "six sides as a PNG (MODEL.png beside the model)");
  options.flag("--json", wanted.json, "one JSON object on stdout");
  if (!options.parse(args)) return std::nullopt;
  static_cast<void>(symmetry_from_name(wanted.symmetry));
  if (!wanted.output.ends_with(".ply") && !wanted.output.ends_with(".pcd")) {
    throw InputError("-o " + wanted.output + ": a model is a .ply or .pcd file");
  }
  if (wanted.find_poses && wanted.given.still) {
    throw InputError("--find-poses and --identity exclude each other");
  }
  wanted.model.roi = parse_box(roi, "--roi");
  wanted.model.min_views = static_cast<std::size_t>(min_views);
  wanted.model.max_points = static_cast<std::size_t>(max_points);
  wanted.views.crop = parse_box(crop, "--crop");
  wanted.views.frames = wanted.given.frames;
  wanted.views.masks = wanted.given.masks;
  wanted.frame.fit_focal = !keep_focal;
  wanted.frame.reach = static_cast<std::size_t>(reach);
  wanted.frame.jobs = static_cast<std::size_t>(jobs);
  return wanted;
}

bool poses_are_given(const TeachOptions& wanted) {
  if (wanted.find_poses) return false;
  if (wanted.given.still) return true;
  const std::vector<std::string>& names = wanted.given.recordings;
  return std::all_of(names.begin(), names.end(), has_given_poses);
}

Taught teach_given(const TeachOptions& wanted) {
  Taught taught;
  GivenViews given = read_given_poses(wanted.given);
  taught.sampling_m = pixel_sampling_m(given.views, given.focal_px);
  taught.views = std::move(given.views);
  return taught;
}

Taught teach_found(const TeachOptions& wanted) {
  Taught taught;
  taught.loaded = load_views(wanted.given.recordings, wanted.views);
  taught.frame = bring_together(taught.loaded, wanted.frame);
  taught.views = taught_views(taught.loaded, *taught.frame);
  taught.sampling_m = views_sampling_m(taught.loaded);
  return taught;
}

Vec3d move_to_center(CloudData& cloud) {
  Vec3d moved = Vec3d::Zero();
  const std::array<std::vector<float>*, 3> axes = {&cloud.x, &cloud.y, &cloud.z};
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<float>& values = *axes[static_cast<std::size_t>(axis)];
    const auto [low, high] = std::minmax_element(values.begin(), values.end());
    const float middle = 0.5F * (*low + *high);
    for (float& value : values) value -= middle;
    moved[axis] = static_cast<double>(middle);
  }
  return moved;
}

std::vector<std::string> unseen_sides(const ModelQuality& quality) {
  std::vector<std::string> sides;
  for (std::size_t i = 0; i < quality.side_open_share.size(); ++i) {
    if (quality.side_open_share[i] > kUnseen) sides.emplace_back(model_sides()[i].name);
  }
  return sides;
}

std::string joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : ", ") + word;
  return text;
}

std::string quality_text(const ModelQuality& quality, const Taught& taught) {
  std::array<char, 256> line{};
  std::snprintf(line.data(), line.size(),
                "cameras on %.0f %% of the view sphere; from all around %.0f %% of the outline "
                "shows the inside, where nothing was seen",
                1e2 * quality.view_sphere_coverage, 1e2 * quality.open_share);
  std::string text = line.data();
  const std::vector<std::string> unseen = unseen_sides(quality);
  if (!unseen.empty()) text += "; never seen from " + joined(unseen);
  if (taught.frame && taught.frame->joint.done) {
    std::snprintf(line.data(), line.size(), "; views overlap to %.2f mm rms",
                  taught.frame->joint.rms_m * 1e3);
    text += line.data();
  }
  return text;
}

nlohmann::ordered_json quality_json(const ModelQuality& quality, const Taught& taught) {
  nlohmann::ordered_json json;
  json["view_sphere_coverage"] = quality.view_sphere_coverage;
  json["open_share"] = quality.open_share;
  for (std::size_t i = 0; i < quality.side_open_share.size(); ++i) {
    json["side_open_share"][std::string(model_sides()[i].name)] = quality.side_open_share[i];
  }
  json["never_seen_from"] = unseen_sides(quality);
  if (taught.frame && taught.frame->joint.done) {
    json["overlap_rms_m"] = taught.frame->joint.rms_m;
  }
  return json;
}

void write_model_toml(const TeachOptions& wanted, const Taught& taught, const FusedModel& model,
                      const ModelQuality& quality) {
  const fs::path file = fs::path(wanted.output).replace_extension(".toml");
  std::ofstream stream(file);
  stream << "# Taught from " << taught.views.size() << " frames, averaged in voxels of "
         << model.voxel_m * 1e3 << " mm.\n"
         << "# Poses: " << (taught.frame ? "found from the views themselves" : "given") << ".\n"
         << "# Quality: " << quality_text(quality, taught) << ".\n"
         << "unit_m = 1.0\n"
         << "symmetry = \"" << wanted.symmetry << "\"\n\n"
         << "[[grasp]]\nid = 1\nname = \"origin\"\n"
         << "model_from_grasp = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]\n";
  stream.flush();
  if (!stream) throw InputError(file.string() + ": can't be written");
}

void write_picture(const TeachOptions& wanted, const FusedModel& model) {
  const fs::path file = wanted.picture.empty() ? fs::path(wanted.output).replace_extension(".png")
                                               : fs::path(wanted.picture);
  const ModelPicture sheet = draw_sides(model.cloud, model.voxel_m, kPictureSide_px);
  write_color_png(file, {sheet.pixels.data(), sheet.width, sheet.height});
}

void print_report(const TeachOptions& wanted, const Taught& taught, const FusedModel& model,
                  const ModelQuality& quality) {
  if (!wanted.json) {
    std::cout << wanted.output << ": " << model.cloud.size() << " points from "
              << taught.views.size() << " frames, voxel " << model.voxel_m * 1e3 << " mm\n";
    if (taught.frame) std::cout << common_frame_text(taught.loaded, *taught.frame);
    std::cout << quality_text(quality, taught) << "\n";
    return;
  }
  nlohmann::ordered_json json;
  json["model"] = wanted.output;
  json["points"] = model.cloud.size();
  json["frames"] = taught.views.size();
  json["voxel_m"] = model.voxel_m;
  json["quality"] = quality_json(quality, taught);
  if (taught.frame) json["common_frame"] = common_frame_json(taught.loaded, *taught.frame);
  std::cout << json.dump(2) << "\n";
}

}  // namespace

int run_teach(std::span<const std::string> args) {
  const std::optional<TeachOptions> wanted = parse(args);
  if (!wanted) return 0;
  const Taught taught = poses_are_given(*wanted) ? teach_given(*wanted) : teach_found(*wanted);
  FusedModel model = fuse_views(taught.views, taught.sampling_m, wanted->model);
  const Vec3d moved = wanted->center ? move_to_center(model.cloud) : Vec3d::Zero();
  std::vector<Vec3d> cameras;
  for (const TaughtView& view : taught.views) {
    cameras.push_back(view.model_from_camera.translation() - moved);
  }
  const ModelQuality quality = measure_quality(model.cloud, model.voxel_m, cameras);
  write_cloud(wanted->output, model.cloud);
  write_model_toml(*wanted, taught, model, quality);
  write_picture(*wanted, model);
  print_report(*wanted, taught, model, quality);
  return taught.frame && !taught.frame->complete() ? 1 : 0;
}

}  // namespace grapnel
