#include <algorithm>
#include <cstdio>
#include <iostream>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "base/clock.h"
#include "base/cloud_file.h"
#include "base/input_error.h"
#include "pipeline/registrar.h"
#include "workbench/commands.h"
#include "workbench/options.h"
#include "workbench/views/common_frame_json.h"
#include "workbench/views/view_model.h"

namespace grapnel {
namespace {

struct ManyOptions {
  std::vector<std::string> names;
  ViewOptions views;
  CommonFrameOptions frame;
  FusedModelOptions model;
  std::string output;
  bool json = false;
};

std::optional<ManyOptions> parse(std::span<const std::string> args) {
  ManyOptions wanted;
  std::string crop;
  bool no_joint = false;
  bool keep_focal = false;
  std::int64_t reach = 0;
  std::int64_t jobs = 1;
  std::int64_t min_views = 1;
  std::int64_t max_points = 200000;
  Options options("register-many",
                  "Brings views into the first one's frame without a guess and fuses them.");
  options.positionals("VIEW", wanted.names, 1,
                      "clouds, PNGs, RECORDING#N, or recordings: a view a frame");
  options.value("--preset", wanted.frame.preset, "of the pairs: name, number or file (pair)");
  options.repeated("--set", wanted.frame.overrides, "key=value over the preset's; repeatable");
  options.value("--camera", wanted.views.input.camera, "camera.toml of bare PNGs");
  options.value("--frames", wanted.views.frames, "of recordings, as 0,2,4 or 0-16:2 (all)");
  options.list("--mask", wanted.views.masks,
               "images, black = leave out: one for all or one a view");
  options.value("--crop", crop, "x0,y0,z0,x1,y1,z1 in metres, in each view's own frame");
  options.integer("--reach", reach, 0, 1000000,
                  "pairs at most this far apart in the list (0 = every pair)");
  options.number("--shared-error", wanted.frame.shared_error_m, 0.0, 10.0,
                 "metres, 1 sigma, that all readings of a view share; 0 = from its size");
  options.flag("--no-joint", no_joint, "leave out the fit of all views at once");
  options.flag("--keep-focal", keep_focal, "take the cameras' focal lengths as they are");
  options.integer("--jobs", jobs, 1, 256, "pairs at once; the result does not depend on it");
  options.value("-o,--output", wanted.output, "the fused views, .ply or .pcd");
  options.number("--voxel", wanted.model.voxel_m, 0.0, 1.0,
                 "metres; 0 = the views' own sampling, wider where --max-points asks for it");
  options.integer("--min-views", min_views, 1, 1000, "views that must have seen a point");
  options.integer("--max-points", max_points, 100, 10000000, "of the fused cloud");
  options.flag("--json", wanted.json, "one JSON object on stdout");
  options.footer("Exit code 0: every view is connected; 1: some are not, and are named.");
  if (!options.parse(args)) return std::nullopt;
  wanted.views.crop = parse_box(crop, "--crop");
  wanted.frame.joint = !no_joint;
  wanted.frame.fit_focal = !keep_focal;
  wanted.frame.reach = static_cast<std::size_t>(reach);
  wanted.frame.jobs = static_cast<std::size_t>(jobs);
  wanted.model.min_views = static_cast<std::size_t>(min_views);
  wanted.model.max_points = static_cast<std::size_t>(max_points);
  return wanted;
}

void print_text(const std::vector<View>& views, const CommonFrame& frame, double total_ms) {
  std::cout << common_frame_text(views, frame);
  std::printf("%s, %.0f ms\n", Registrar::simd_target(), total_ms);
}

}  // namespace

int run_register_many(std::span<const std::string> args) {
  const std::optional<ManyOptions> wanted = parse(args);
  if (!wanted) return 0;
  const std::vector<View> views = load_views(wanted->names, wanted->views);
  const MonotonicClock clock;
  const std::int64_t begin_us = clock.now_us();
  const CommonFrame frame = bring_together(views, wanted->frame);
  const double total_ms = static_cast<double>(clock.now_us() - begin_us) / 1000.0;
  std::optional<FusedModel> model;
  if (!wanted->output.empty()) {
    model = fuse_views(taught_views(views, frame), views_sampling_m(views), wanted->model);
    write_cloud(wanted->output, model->cloud);
  }
  if (wanted->json) {
    nlohmann::ordered_json json = common_frame_json(views, frame);
    json["simd"] = Registrar::simd_target();
    json["preset"] = wanted->frame.preset;
    json["total_ms"] = total_ms;
    if (model) {
      json["model"] = {
          {"file", wanted->output}, {"points", model->cloud.size()}, {"voxel_m", model->voxel_m}};
    }
    std::cout << json.dump(2) << "\n";
  } else {
    print_text(views, frame, total_ms);
  }
  return frame.complete() ? 0 : 1;
}

}  // namespace grapnel
